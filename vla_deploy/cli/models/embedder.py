"""Carry out `vla-deploy models` for a text embedder: add and fetch it."""

import argparse
import dataclasses
from collections.abc import Callable

from platforms import Profile
from vla_deploy.cli.models.arguments import Result
from vla_deploy.inference.manifest import Pooling
from vla_deploy.inference.manifest_schema import TEXT_EMBEDDER
from vla_deploy.inference.opening import PLAIN_CHOICE
from vla_deploy.inference.roles import ModelShelf
from vla_deploy.model_tools.keeping import require_free
from vla_deploy.model_tools.published import TEXT_EMBEDDERS, fetched
from vla_deploy.model_tools.text_embedders import (
    LEAST_COSINE,
    MOST_TOKENS,
    TextEmbedderSource,
    add_text_embedder,
)


def add(arguments: argparse.Namespace, shelf: ModelShelf, profile: Profile) -> Result:
    """Check a text embedder, try it out as a profile says and keep it."""
    source = TextEmbedderSource(
        name=arguments.name,
        folder=arguments.embedder,
        summary=arguments.summary or "a text embedder that was added",
        licence=arguments.licence,
        card=arguments.card,
        pooling=Pooling(arguments.pooling),
        most_tokens=min(arguments.most_tokens, MOST_TOKENS),
        least_cosine=arguments.least_cosine,
    )
    return _kept(arguments, shelf, profile, source)


def fetch(
    arguments: argparse.Namespace,
    shelf: ModelShelf,
    profile: Profile,
    report: Callable[[str], None],
) -> Result:
    """Fetch a published text embedder, check it, try it out as a profile says and keep it."""
    published = TEXT_EMBEDDERS[arguments.name]
    name = arguments.new_name or arguments.name
    require_free(shelf.store, name, replace=arguments.replace)
    published = dataclasses.replace(published, revision=arguments.revision or published.revision)
    with fetched(published, shelf.store, report, arguments.endpoint) as (folder, licence):
        source = TextEmbedderSource(
            name=name,
            folder=folder,
            summary=published.summary,
            licence=arguments.licence or licence,
            pooling=Pooling.MEAN,
            most_tokens=MOST_TOKENS,
            least_cosine=LEAST_COSINE,
        )
        return _kept(arguments, shelf, profile, source)


def _kept(
    arguments: argparse.Namespace, shelf: ModelShelf, profile: Profile, source: TextEmbedderSource
) -> Result:
    model, trial = add_text_embedder(
        shelf.store,
        source,
        replace=arguments.replace,
        choice=profile.models.get(TEXT_EMBEDDER, PLAIN_CHOICE),
    )
    name = model.manifest.name
    document: dict[str, object] = {
        "name": name,
        "folder": str(model.folder),
        "same_meaning_cosine": round(trial.same, 3),
        "other_meaning_cosine": round(trial.other, 3),
    }
    text = (
        f"added {name} in {model.folder}; it finds two sentences of one meaning {trial.same:.2f} "
        f"alike, two of different meanings {trial.other:.2f}\n"
        "next: the memory is searched by meaning from the next start on; now: "
        'vla-deploy memory search "something to drink"'
    )
    return document, text
