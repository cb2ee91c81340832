"""Carry out `vla-deploy models` for a text embedder: add it."""

import argparse

from platforms import Profile
from vla_deploy.cli.models.arguments import Result
from vla_deploy.inference.manifest import Pooling
from vla_deploy.inference.manifest_schema import TEXT_EMBEDDER
from vla_deploy.inference.opening import PLAIN_CHOICE
from vla_deploy.inference.roles import ModelShelf
from vla_deploy.model_tools.text_embedders import TextEmbedderSource, add_text_embedder


def add(arguments: argparse.Namespace, shelf: ModelShelf, profile: Profile) -> Result:
    """Check a text embedder, try it out as a profile says and keep it."""
    source = TextEmbedderSource(
        name=arguments.name,
        folder=arguments.embedder,
        summary=arguments.summary or "a text embedder that was added",
        licence=arguments.licence,
        card=arguments.card,
        pooling=Pooling(arguments.pooling),
        most_tokens=min(arguments.most_tokens, 512),
        least_cosine=arguments.least_cosine,
    )
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
