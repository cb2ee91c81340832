"""Do what `vla-deploy models` does with a language model: add, measure and check it."""

import argparse
import dataclasses
from collections.abc import Callable, Iterator
from functools import partial

from platforms import ModelChoice, Profile
from vla_deploy.inference.errors import InferenceError
from vla_deploy.inference.file_check import check_parts
from vla_deploy.inference.opening import PLAIN_CHOICE
from vla_deploy.inference.roles import ModelShelf, choice_for
from vla_deploy.inference.store import Model
from vla_deploy.perception.model_tools.verifying import Finding
from vla_deploy.planning.language_model.adding import (
    LanguageModelSource,
    add_language_model,
    try_out,
)
from vla_deploy.planning.language_model.benching import LanguageModelBench, bench

Told = tuple[dict[str, object], str]


def add(arguments: argparse.Namespace, shelf: ModelShelf) -> Told:
    """Check a language model, try it out and keep it."""
    request = LanguageModelSource(
        name=arguments.name,
        folder=arguments.language,
        most_tokens=arguments.most_tokens,
        summary=arguments.summary or "a language model that was added",
        licence=arguments.licence,
        card=arguments.card,
    )
    model, answer = add_language_model(
        shelf.store, request, clock=shelf.clock, replace=arguments.replace
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
        f'[models.planner] tiers = ["{name}"]'
    )
    return document, text


def measure(
    arguments: argparse.Namespace, shelf: ModelShelf, model: Model, profile: Profile
) -> Told:
    """Measure what a language model costs."""
    choice: ModelChoice = profile.models.get(model.manifest.role, PLAIN_CHOICE)
    if arguments.threads:
        choice = dataclasses.replace(choice, threads=arguments.threads)
    figures = bench(model, choice, rounds=arguments.rounds, clock=shelf.clock)
    return figures.document(), _text(figures)


def findings(shelf: ModelShelf, model: Model, profile: Profile | None) -> Iterator[Finding]:
    """Check an installed language model."""
    name = model.manifest.name
    yield Finding(model=name, check="manifest", is_ok=True, detail=str(model.folder))
    yield _finding(name, "parts", partial(_whole, model))
    yield _finding(name, "run", partial(_tried, shelf, model, PLAIN_CHOICE))
    if profile is not None:
        choice = choice_for(model.manifest.role, profile)
        yield _finding(name, f"profile {profile.name}", partial(_tried, shelf, model, choice))


def _whole(model: Model) -> str:
    check_parts(model)
    return f"{len(model.manifest.parts)} files, SHA-256 as in the manifest"


def _tried(shelf: ModelShelf, model: Model, choice: ModelChoice) -> str:
    answer = try_out(model, shelf.clock, choice)
    return f"answers {answer.text} in {answer.runs} runs"


def _finding(model: str, check: str, act: Callable[[], str]) -> Finding:
    try:
        return Finding(model=model, check=check, is_ok=True, detail=act())
    except InferenceError as error:
        return Finding(model=model, check=check, is_ok=False, detail=str(error))


def _text(figures: LanguageModelBench) -> str:
    return "\n".join(
        [
            f"answer      {1000 * figures.answer_median_s:8.1f} ms median, "
            f"{1000 * figures.answer_p95_s:.1f} ms p95",
            f"reads       {figures.read_tokens_per_s:8.0f} tokens/s, "
            f"a prompt of {figures.prompt_tokens}",
            f"tells       {figures.told_tokens_per_s:8.0f} tokens/s",
            *(f"note: {notice}" for notice in figures.notices),
            f"{figures.provider}, {figures.threads} threads; loaded in {figures.load_s:.2f} s, "
            f"{figures.memory_mb:.0f} MB",
        ]
    )
