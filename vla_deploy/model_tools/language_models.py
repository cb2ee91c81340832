"""Add a person's language model, and measure what it costs."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final, TypeVar

import numpy as np

from drivers.clock import NS_PER_S, Clock
from platforms import ModelChoice
from vla_deploy.inference.errors import ModelMismatch
from vla_deploy.inference.language_model import (
    AnswerBounds,
    LanguageModel,
    ModelAnswer,
    open_language_model,
)
from vla_deploy.inference.language_model.model_folder import CONFIG, TEMPLATE, read_genai_config
from vla_deploy.inference.manifest import Language, LanguageUse, Manifest
from vla_deploy.inference.manifest_schema import GENAI_CONFIG, PLANNER, TOKENIZER
from vla_deploy.inference.memory_claims import resident_mb
from vla_deploy.inference.opening import PLAIN_CHOICE
from vla_deploy.inference.store import ModelStore, StoredModel
from vla_deploy.model_tools.keeping import FolderSource, keep_folder, require_free
from vla_deploy.runtime.deadline import Deadline

_PARTS: Final = (GENAI_CONFIG, TOKENIZER, CONFIG, TEMPLATE)
_WEIGHTS: Final = (".onnx", ".onnx.data", ".onnx_data")
_TRIAL_S: Final = 120.0
_TRIAL_SCHEMA: Final = {
    "type": "object",
    "properties": {"skill": {"enum": ["go_to", "wait"]}, "place": {"enum": ["kitchen", "hall"]}},
    "required": ["skill", "place"],
    "additionalProperties": False,
}
_TRIAL: Final = (
    {"role": "system", "content": "You plan for a robot. Answer with one step as JSON."},
    {"role": "user", "content": "go to the kitchen"},
)
T = TypeVar("T")


@dataclass(frozen=True, slots=True, kw_only=True)
class LanguageModelSource(FolderSource):
    """Hold what a person says of a language model."""

    most_tokens: int


def add_language_model(
    store: ModelStore,
    source: LanguageModelSource,
    *,
    clock: Clock,
    replace: bool = False,
    choice: ModelChoice = PLAIN_CHOICE,
) -> tuple[StoredModel, ModelAnswer]:
    """Check a model, try it out as `choice` says, keep it; when anything is wrong, nothing changes.

    Returns the model, and its answer to a small command.

    Raises:
        ModelUnknown: the name cannot be used, or is taken and `replace` is not set.
        ModelMismatch: files are missing, or do not fit together.
        InferenceError: it does not run; each kind says why.
        OSError: the model cannot be stored.
    """
    require_free(store, source.name, replace=replace)
    return keep_folder(store, source, describe(source), lambda model: try_out(model, clock, choice))


def describe(source: LanguageModelSource) -> Manifest:
    """Return the manifest for a folder of files.

    Raises:
        ModelMismatch: one that is needed is missing, or the configuration has faults.
        ModelFileSpoiled: one cannot be read.
    """
    graph = read_genai_config(source.folder).file_name
    names = sorted(path.name for path in source.folder.iterdir() if is_part(path.name))
    missing = [name for name in (GENAI_CONFIG, TOKENIZER, graph) if name not in names]
    if missing:
        faults = tuple(f"{name} is missing; export the model again" for name in missing)
        raise ModelMismatch(str(source.folder), faults)
    language = Language(use=LanguageUse.CHAT, most_tokens=source.most_tokens)
    return source.manifest(PLANNER, names, language=language)


def is_part(name: str) -> bool:
    """Return whether a file of such a folder is used; the others are for other runtimes."""
    return name in _PARTS or name.endswith(_WEIGHTS)


def try_out(model: StoredModel, clock: Clock, choice: ModelChoice = PLAIN_CHOICE) -> ModelAnswer:
    """Return a model's answer to a small command, as JSON of a small schema.

    Raises:
        InferenceError: it does not run, or not within two minutes; each kind says why.
    """
    opened = open_language_model(model, choice)
    try:
        return _ask(opened, clock)
    finally:
        opened.close()


def _ask(model: LanguageModel, clock: Clock) -> ModelAnswer:
    """Return an open model's answer to the same small command."""
    bounds = AnswerBounds(
        deadline=Deadline.within(clock, _TRIAL_S), most_tokens=model.language.most_tokens
    )
    return model.answer(_TRIAL, bounds, dict(_TRIAL_SCHEMA))


def bench(model: StoredModel, choice: ModelChoice, *, rounds: int, clock: Clock) -> dict[str, Any]:
    """Return the figures of a model, as JSON takes them.

    `answer_*_s` are of answers to the same small command, `read_tokens_per_s` of a prompt of
    `prompt_tokens`, `told_tokens_per_s` of single tokens behind it; `memory_mb` is by how much the
    process grew.

    Raises:
        InferenceError: it cannot be run as the choice asks.
    """
    before_mb = resident_mb()
    opened, load_s = _timed(clock, lambda: open_language_model(model, choice))
    try:
        answers_s, reads_s, tokens_s = [], [], []
        prompt_tokens = _ask(opened, clock).prompt_tokens
        prompt = opened.decoder.tokens[:prompt_tokens]
        for _ in range(rounds):
            opened.decoder.keep([])
            answers_s.append(_timed(clock, lambda: _ask(opened, clock))[1])
            opened.decoder.keep([])
            reads_s.append(_timed(clock, lambda: opened.decoder.feed(prompt))[1])
            tokens_s.append(_timed(clock, lambda: opened.decoder.feed(prompt[-1:]))[1])
        return {
            "model": model.manifest.name,
            "provider": opened.provider,
            "threads": choice.threads,
            "rounds": rounds,
            "answer_median_s": float(np.median(answers_s)),
            "answer_p95_s": float(np.percentile(answers_s, 95)),
            "prompt_tokens": prompt_tokens,
            "read_tokens_per_s": prompt_tokens / float(np.median(reads_s)),
            "told_tokens_per_s": 1.0 / float(np.median(tokens_s)),
            "load_s": load_s,
            "memory_mb": max(0.0, resident_mb() - before_mb),
            "notices": list(opened.notices),
        }
    finally:
        opened.close()


def _timed(clock: Clock, act: Callable[[], T]) -> tuple[T, float]:
    """Return what an act gives, and how many seconds it took."""
    began_ns = clock.now_ns()
    found = act()
    return found, (clock.now_ns() - began_ns) / NS_PER_S
