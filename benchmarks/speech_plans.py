"""Measure whether a spoken command gives the plan that the typed one gives, and spoken talk none.

Commands and other talk are those of the planner's corpora, which no training has read; they are
spoken by voices that the recogniser never heard. What it is not sure of is asked again, and counts
as not understood. Commands that the planner does not understand when they are typed are left out.
"""

import re
import sys
from collections.abc import Callable, Sequence
from contextlib import closing
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from benchmarks.command import parser, show
from benchmarks.planner_corpus import PLAN, Case, commands, home, other_talk, scenes
from benchmarks.planner_desk import Answer, fresh_desk
from benchmarks.speech_words import open_shipped
from training.speech.judging import NOISY_DB
from training.speech.sentences import normal
from training.speech.trials import NAMES, by_held_out_voices, by_unseen_engine, heard
from training.voices.clip import Clip
from training.voices.errors import EngineMissing
from vla_deploy.speech.confidence import confidence
from vla_deploy.speech.recogniser import Recogniser

Random = np.random.Generator
_SETS: Final[dict[str, tuple[Callable[[Sequence[str], Random], list[Clip]], float | None]]] = {
    "held_out_voices": (by_held_out_voices, None),
    "10db": (by_held_out_voices, NOISY_DB),
    "unseen_engine": (by_unseen_engine, None),
}
_TALK_SCENE: Final = "tidy"
_WRITTEN: Final = re.compile(r"\bcm\b")
"""How nobody says it: an engine would spell it letter by letter."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Typed:
    """Hold a command of one turn, and what comes of it when it is typed."""

    case: Case
    text: str
    answer: Answer


def measure(count: int = 100, talk: int = 200, seed: int = 0) -> dict[str, Any]:
    """Return the figures.

    Raises:
        InferenceError: the recogniser cannot be opened.
        EngineMissing: eSpeak NG is not installed.
    """
    typed = list(_understood(count))
    texts = [_WRITTEN.sub("centimeters", one.text) for one in typed]
    figures: dict[str, Any] = {"commands": len(typed), "missing": []}
    recogniser, least = open_shipped("desktop")
    with closing(recogniser):
        for name, (speak, snr_db) in _SETS.items():
            random = np.random.default_rng([seed, 5])
            try:
                clips = [heard(clip, random, snr_db) for clip in speak(texts, random)]
            except EngineMissing as error:
                figures["missing"].append(str(error))
                figures[f"same_plan_{name}"] = None
                continue
            pairs = zip(typed, clips, strict=True)
            same = [_is_same(one, _read(recogniser, clip, least)) for one, clip in pairs]
            figures[f"same_plan_{name}"] = float(np.mean(same))
        return figures | _talk(recogniser, least, other_talk()[:talk], seed)


def _understood(count: int) -> "list[Typed]":
    """Return commands of one turn that give a plan when typed, evenly from all kinds."""
    single = [one for one in commands() if len(one.turns) == 1 and PLAN in one.turns[0].must]
    step = max(1, len(single) // count)
    tried = [_typed(one, one.turns[0].say) for one in single[::step]]
    return [one for one in tried if one.answer.outcome == PLAN or one.answer.reads_back]


def _typed(case: Case, text: str) -> Typed:
    return Typed(case=case, text=text, answer=_answer(case.scene, text))


def _answer(scene: str, text: str) -> Answer:
    """Return what a planner to whom nobody has spoken yet makes of a text."""
    with fresh_desk() as desk:
        desk.tell(scenes()[scene].world(home()))
        return desk.say(text)[1]


def _read(recogniser: Recogniser, clip: Clip, least: float) -> str:
    """Return the words, or nothing where the robot would ask again."""
    reading = recogniser.read(clip.samples, NAMES)
    sure = confidence(reading, recogniser.declared.calibration) >= least
    return reading.text if sure else ""


def _is_same(typed: Typed, text: str) -> bool:
    if not text:
        return False
    if normal(text) == normal(typed.text):
        return True
    answer = _answer(typed.case.scene, text)
    return answer.outcome == typed.answer.outcome and _steps(answer) == _steps(typed.answer)


def _steps(answer: Answer) -> list[tuple[str, Any]]:
    plan = answer.plan or {}
    return [(one["skill"], one.get("parameters", {})) for one in plan.get("actions", [])]


def _talk(recogniser: Recogniser, least: float, texts: Sequence[str], seed: int) -> dict[str, Any]:
    """Return which share of other talk, spoken, ends in no plan, and how many plans would run."""
    random = np.random.default_rng([seed, 6])
    clips = [heard(clip, random) for clip in by_held_out_voices(texts, random)]
    read = [_read(recogniser, clip, least) for clip in clips]
    outcomes = [_answer(_TALK_SCENE, text).outcome if text else "unsure" for text in read]
    planned = [text for text, outcome in zip(read, outcomes, strict=True) if outcome == PLAN]
    return {
        "talk": len(texts),
        "talk_rejected_ratio": 1.0 - len(planned) / max(1, len(texts)),
        "talk_unsure_ratio": outcomes.count("unsure") / max(1, len(texts)),
        "talk_planned": planned,
    }


def main(argv: Sequence[str] | None = None) -> int:
    """Print the figures."""
    arguments = parser("speech --part plans", __doc__)
    arguments.add_argument("--commands", type=int, default=100)
    arguments.add_argument("--talk", type=int, default=200)
    arguments.add_argument("--seed", type=int, default=0)
    given = arguments.parse_args(argv)
    show(measure(given.commands, given.talk, given.seed), as_json=given.json)
    return 0


if __name__ == "__main__":
    sys.exit(main())
