"""Judge the exported model as the robot runs it: right answers, doubt, time."""

import dataclasses
import json
import logging
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from random import Random
from typing import Any, Final

import numpy as np

from drivers.clock import NS_PER_S, MonotonicClock
from training.planner.certainty_fit import Judged, fit
from training.planner.files import METRICS
from training.planner.sentences.composing import Composer, Example
from vla_deploy.inference.language_model import LanguageModel
from vla_deploy.inference.manifest import Certainty, Language, LanguageUse
from vla_deploy.inference.opening import PLAIN_CHOICE
from vla_deploy.planning.command_parser.certainty import confidence_of
from vla_deploy.planning.command_parser.grammar import COPIED_FIELDS, Step
from vla_deploy.planning.command_parser.rung import CommandParser, known_words
from vla_deploy.runtime.deadline import Deadline

MOST_TOKENS: Final = 160
_DEADLINE_S: Final = 10.0
_SEEDS: Final = {"fit": 501, "judge": 502}
# Which of them is said makes no difference to what the robot does: nothing.
REFUSALS: Final = frozenset({"unknown", "impossible", "nothing"})
_LOG = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True, kw_only=True)
class ToldExample:
    """Hold what the model told of one example, and how long that took."""

    example: Example
    steps: tuple[Step, ...]
    judged: Judged
    took_s: float

    @property
    def acts(self) -> bool:
        """Return whether the answer would have the robot do something."""
        return not _refuses(self.steps)


def evaluate(models: Path, count: int, chatter: Sequence[str]) -> None:
    """Fit the doubt on one set, judge on another, and write `metrics.json`.

    `chatter` are sentences of other talk that training has not seen.

    Raises:
        InferenceError: the exported model does not run.
    """
    parser = _parser(models)
    fitted = [one.judged for one in _told(parser, examples("fit", count, chatter))]
    weights = fit(fitted)
    sets = {
        "seen_phrases": _of(Composer(), count, "judge"),
        "kept_back_phrases": _of(Composer(held_out=True), count, "judge"),
        "other_talk": [Example(text, "") for text in chatter[count : 2 * count]],
    }
    told = {name: _told(parser, given) for name, given in sets.items() if given}
    metrics = {
        "certainty": dataclasses.asdict(weights),
        "sets": {name: figures(one, weights) for name, one in told.items()},
        "took_p50_s": _percentile(told, 50),
        "took_p95_s": _percentile(told, 95),
    }
    (models / METRICS).write_text(json.dumps(metrics, indent=2) + "\n", encoding="utf-8")
    _LOG.info("%s", json.dumps(metrics["sets"]))


def examples(seed: str, count: int, chatter: Sequence[str]) -> list[Example]:
    """Return what the doubt is fitted on: phrases learnt and kept back alike, and other talk.

    What people say is mostly like what was kept back: nobody says just what was learnt.
    """
    talk = [Example(text, "") for text in chatter[: count // 3]]
    learnt = _of(Composer(), count // 2, seed)
    return [*learnt, *_of(Composer(held_out=True), 3 * count // 2, seed), *talk]


def figures(told: Sequence[ToldExample], weights: Certainty) -> dict[str, Any]:
    """Return how many answers were right, and what the doubt makes of them.

    `acted` are those that would be carried out, `read_back` those of them that ask first;
    `wrong_unasked` is the share of all commands that would be carried out wrongly without asking.
    """
    sure = np.array([confidence_of(one.judged.features, weights) for one in told])
    right = np.array([one.judged.is_right for one in told])
    acts = np.array([one.acts for one in told]) & (sure >= weights.decline_below)
    asks = acts & (sure < weights.read_back_below)
    return {
        "count": len(told),
        "right": _share(right),
        "acted": _share(acts),
        "read_back": _share(asks),
        "wrong_unasked": _share(acts & ~asks & ~right),
        "right_where_unasked": _share(right[acts & ~asks]),
    }


def _parser(models: Path) -> CommandParser:
    language = Language(use=LanguageUse.COMMAND_PARSER, most_tokens=MOST_TOKENS)
    return CommandParser(LanguageModel(models, language, PLAIN_CHOICE), known_words(models))


def _of(composer: Composer, count: int, seed: str) -> list[Example]:
    random = Random(_SEEDS[seed])
    return [composer.example(random) for _ in range(count)]


def _told(parser: CommandParser, given: Sequence[Example]) -> list[ToldExample]:
    return [_one(parser, example) for example in given]


def _one(parser: CommandParser, example: Example) -> ToldExample:
    clock = MonotonicClock()
    began_ns = clock.now_ns()
    parsed = parser.parse(example.command, Deadline.within(clock, _DEADLINE_S))
    took_s = (clock.now_ns() - began_ns) / NS_PER_S
    wanted = _steps(example.answer) if example.answer else ({"do": "unknown"},)
    return ToldExample(
        example=example,
        steps=parsed.steps,
        judged=Judged(parsed.features, is_same(parsed.steps, wanted)),
        took_s=took_s,
    )


def is_same(steps: Sequence[Step], wanted: Sequence[Step]) -> bool:
    """Return whether two answers have the robot do the same."""
    return (_refuses(steps) and _refuses(wanted)) or list(steps) == list(wanted)


def _refuses(steps: Sequence[Step]) -> bool:
    return any(step["do"] in REFUSALS for step in steps)


def _steps(answer: str) -> tuple[Step, ...]:
    return tuple(
        {name: text.strip() if name in COPIED_FIELDS else text for name, text in step.items()}
        for step in json.loads(answer)["steps"]
    )


def _share(values: Any) -> float:
    return round(float(np.mean(values)), 4) if len(values) else 0.0


def _percentile(told: dict[str, list[ToldExample]], percent: int) -> float:
    times = [one.took_s for every in told.values() for one in every]
    return round(float(np.percentile(times, percent)), 4)
