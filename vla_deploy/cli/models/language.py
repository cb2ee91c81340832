"""Carry out `vla-deploy models` for a language model: add, fetch and measure it."""

import argparse
import dataclasses
from collections.abc import Callable, Mapping
from typing import Any

from platforms import Profile
from vla_deploy.cli.errors import UsageError
from vla_deploy.cli.models.arguments import Result, choice_of
from vla_deploy.inference.manifest_schema import PLANNER
from vla_deploy.inference.opening import PLAIN_CHOICE
from vla_deploy.inference.roles import ModelShelf
from vla_deploy.inference.store import StoredModel
from vla_deploy.model_tools.keeping import require_free
from vla_deploy.model_tools.language_models import LanguageModelSource, add_language_model, bench
from vla_deploy.model_tools.published import LANGUAGE_MODELS, PublishedModel, fetched


def add(arguments: argparse.Namespace, shelf: ModelShelf, profile: Profile) -> Result:
    """Check a language model, try it out as a profile says and keep it."""
    source = LanguageModelSource(
        name=arguments.name,
        folder=arguments.language,
        most_tokens=arguments.most_tokens,
        summary=arguments.summary or "a language model that was added",
        licence=arguments.licence,
        card=arguments.card,
    )
    return _kept(arguments, shelf, profile, source)


def fetch(
    arguments: argparse.Namespace,
    shelf: ModelShelf,
    profile: Profile,
    report: Callable[[str], None],
) -> Result:
    """Fetch a published language model, check it, try it out as a profile says and keep it."""
    name = arguments.new_name or arguments.name
    if name is None:
        raise UsageError("expected --as NAME: what to call the model; profiles name it as a tier")
    require_free(shelf.store, name, replace=arguments.replace)
    published = _published(arguments)
    with fetched(published, shelf.store, report, arguments.endpoint) as (folder, licence):
        source = LanguageModelSource(
            name=name,
            folder=folder,
            most_tokens=arguments.most_tokens,
            summary=f"{published.summary}: {published}",
            licence=arguments.licence or licence,
        )
        return _kept(arguments, shelf, profile, source)


def _published(arguments: argparse.Namespace) -> PublishedModel:
    if arguments.language is None:
        found = LANGUAGE_MODELS[arguments.name]
    else:
        found = PublishedModel.named(arguments.language)
    return dataclasses.replace(found, revision=arguments.revision or found.revision)


def _kept(
    arguments: argparse.Namespace,
    shelf: ModelShelf,
    profile: Profile,
    source: LanguageModelSource,
) -> Result:
    model, answer = add_language_model(
        shelf.store,
        source,
        clock=shelf.clock,
        replace=arguments.replace,
        choice=profile.models.get(PLANNER, PLAIN_CHOICE),
    )
    name = model.manifest.name
    document: dict[str, object] = {
        "name": name,
        "folder": str(model.folder),
        "answers": answer.text,
        "prompt_tokens": answer.prompt_tokens,
    }
    text = (
        f'added {name} in {model.folder}; asked to "go to the kitchen" it answers {answer.text}\n'
        f"next: vla-deploy models bench {name}, then name it in a profile: "
        f'[models.planner] tiers = ["{name}", "command_parser"]'
    )
    return document, text


def measure(
    arguments: argparse.Namespace, shelf: ModelShelf, model: StoredModel, profile: Profile
) -> Result:
    """Measure what a language model costs."""
    choice = choice_of(arguments, model, profile, PLAIN_CHOICE)
    figures = bench(model, choice, rounds=arguments.rounds, clock=shelf.clock)
    return figures, _text(figures)


def _text(figures: Mapping[str, Any]) -> str:
    return "\n".join(
        [
            f"answer      {1000 * figures['answer_median_s']:8.1f} ms median, "
            f"{1000 * figures['answer_p95_s']:.1f} ms p95",
            f"reads       {figures['read_tokens_per_s']:8.0f} tokens/s, "
            f"a prompt of {figures['prompt_tokens']}",
            f"tells       {figures['told_tokens_per_s']:8.0f} tokens/s",
            *(f"note: {notice}" for notice in figures["notices"]),
            f"{figures['provider']}, {figures['threads']} threads; loaded in "
            f"{figures['load_s']:.2f} s, {figures['memory_mb']:.0f} MB",
        ]
    )
