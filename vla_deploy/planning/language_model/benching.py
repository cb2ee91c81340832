"""Measure what a language model costs: reading a prompt, each token of an answer, memory."""

from collections.abc import Callable
from typing import Any, TypeVar

import numpy as np

from drivers.clock import NS_PER_S, Clock
from platforms import ModelChoice
from vla_deploy.inference.stats import resident_mb
from vla_deploy.inference.store import Model
from vla_deploy.planning.language_model.adding import ask
from vla_deploy.planning.language_model.model import open_language_model

T = TypeVar("T")


def bench(model: Model, choice: ModelChoice, *, rounds: int, clock: Clock) -> dict[str, Any]:
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
        prompt_tokens = ask(opened, clock).prompt_tokens
        prompt = opened.decoder.tokens[:prompt_tokens]
        for _ in range(rounds):
            opened.decoder.keep([])
            answers_s.append(_timed(clock, lambda: ask(opened, clock))[1])
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
