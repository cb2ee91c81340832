"""Measure whether a spoken command gives the plan that the typed one gives, and spoken talk none.

Commands and other talk are those of the planner's corpora, which no training has read; they are
spoken by voices that the recogniser never heard. What it is not sure of, and what makes no sense to
the planner, is asked again, and counts as not understood; a plan that is read back because it is
not sure that it was heard right counts, and its share is told. Commands that the planner does not
understand when they are typed are left out.
"""

import re
import sys
from collections.abc import Callable, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from benchmarks.command import parser, show
from benchmarks.planner_corpus import PLAN, Case, commands, home, other_talk, scenes
from benchmarks.planner_session import PlannerAnswer, fresh_session
from benchmarks.speech_words import open_shipped
from drivers.clock import NS_PER_S
from training.speech.judging import NOISY_DB
from training.speech.trials import by_held_out_voices, by_unseen_engine, heard
from training.voices.clip import SpokenClip
from training.voices.errors import EngineMissing
from vla_deploy.speech.asr_pipeline import HeardPhrase
from vla_deploy.speech.endpointing import Phrase
from vla_deploy.speech.event_publisher import SOURCE, utterance
from vla_deploy.speech.recogniser import Recogniser
from vla_deploy.speech.verdict import PhraseVerdict, judge

Random = np.random.Generator
_SETS: Final[
    dict[str, tuple[Callable[[Sequence[str], Random], list[SpokenClip]], float | None]]
] = {
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
    answer: PlannerAnswer


def measure(count: int = 100, talk: int = 200, seed: int = 0) -> dict[str, Any]:
    """Return the figures.

    Raises:
        InferenceError: the recogniser cannot be opened.
        EngineMissing: eSpeak NG is not installed.
    """
    typed = list(_understood(count))
    texts = [_WRITTEN.sub("centimeters", one.text) for one in typed]
    figures: dict[str, Any] = {"commands": len(typed), "missing": []}
    figures |= {"read_back_ratio": {}, "wrong_ratio": {}}
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
            answers = [
                _heard_answer(one.case.scene, recogniser, clip, least) for one, clip in pairs
            ]
            figures[f"same_plan_{name}"] = _share(_is_same, typed, answers)
            figures["read_back_ratio"][name] = _share(_is_read_back, typed, answers)
            figures["wrong_ratio"][name] = _share(_runs_another, typed, answers)
        return figures | _talk(recogniser, least, other_talk()[:talk], seed)


def _understood(count: int) -> "list[Typed]":
    """Return commands of one turn that give a plan when typed, evenly from all kinds."""
    single = [one for one in commands() if len(one.turns) == 1 and PLAN in one.turns[0].must]
    step = max(1, len(single) // count)
    tried = [_typed(one, one.turns[0].say) for one in single[::step]]
    return [one for one in tried if one.answer.outcome == PLAN or one.answer.reads_back]


def _typed(case: Case, text: str) -> Typed:
    return Typed(case=case, text=text, answer=_answer(case.scene, {"text": text}))


def _answer(scene: str, given: Mapping[str, Any]) -> PlannerAnswer:
    """Return what a planner to whom nobody has spoken yet makes of an utterance."""
    with fresh_session() as session:
        session.tell(scenes()[scene].world(home()))
        return session.give(**given)[1]


def _heard_answer(
    scene: str, recogniser: Recogniser, clip: SpokenClip, least: float
) -> PlannerAnswer | None:
    """Return what comes of a spoken command; None where speech alone asks for it again."""
    heard = _heard(recogniser, clip, least)
    doubted = heard.judgement.verdict is PhraseVerdict.DOUBTED
    if not doubted and heard.judgement.verdict is not PhraseVerdict.ACCEPTED:
        return None
    return _answer(scene, {"source": SOURCE, **utterance(heard, doubted=doubted)})


def _heard(recogniser: Recogniser, clip: SpokenClip, least: float) -> HeardPhrase:
    reading = recogniser.read(clip.samples)
    phrase = Phrase(began_ns=0, ended_ns=round(clip.duration_s * NS_PER_S), samples=clip.samples)
    return HeardPhrase(phrase=phrase, transcript=reading, judgement=judge(reading, "", least))


def _share(
    holds: Callable[[Typed, PlannerAnswer], bool],
    typed: Sequence[Typed],
    answers: Sequence[PlannerAnswer | None],
) -> float:
    pairs = zip(typed, answers, strict=True)
    return float(np.mean([answer is not None and holds(one, answer) for one, answer in pairs]))


def _is_same(typed: Typed, answer: PlannerAnswer) -> bool:
    plans = answer.outcome == PLAN or answer.reads_back
    return plans and _steps(answer) == _steps(typed.answer)


def _is_read_back(typed: Typed, answer: PlannerAnswer) -> bool:
    return _is_same(typed, answer) and answer.reads_back and not typed.answer.reads_back


def _runs_another(typed: Typed, answer: PlannerAnswer) -> bool:
    """Return whether something else than was said would be done, and nobody is asked before."""
    return answer.outcome == PLAN and not _is_same(typed, answer)


def _steps(answer: PlannerAnswer) -> list[tuple[str, Any]]:
    plan = answer.plan or {}
    return [(one["skill"], one.get("parameters", {})) for one in plan.get("actions", [])]


def _talk(recogniser: Recogniser, least: float, texts: Sequence[str], seed: int) -> dict[str, Any]:
    """Return which share of other talk, spoken, ends in no plan, and how many plans would run."""
    random = np.random.default_rng([seed, 6])
    clips = [heard(clip, random) for clip in by_held_out_voices(texts, random)]
    answers = [_heard_answer(_TALK_SCENE, recogniser, clip, least) for clip in clips]
    pairs = list(zip(texts, answers, strict=True))
    planned = [text for text, one in pairs if one is not None and one.outcome == PLAN]
    return {
        "talk": len(texts),
        "talk_rejected_ratio": 1.0 - len(planned) / max(1, len(texts)),
        "talk_unheeded_ratio": answers.count(None) / max(1, len(texts)),
        "talk_read_back": [text for text, one in pairs if one is not None and one.reads_back],
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
