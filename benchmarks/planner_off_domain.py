"""Measure how surely other talk in the home is left alone: rejected or asked back, never executed.

Each of the sentences of `benchmarks/corpora/off_domain.txt` is said to the planner in a flat where
everything has been seen. `off_domain_executed` counts the plans that reached the executor, spoken
answers among them; `off_domain_moved` those that move the robot.
"""

from collections.abc import Sequence
from typing import Any, Final

from benchmarks.planner_bounds import moves
from benchmarks.planner_corpus import ASK, PLAN, REFUSE, home, other_talk, scenes
from benchmarks.planner_session import fresh_session

SCENE: Final = "tidy"


def measure(misses: bool = False) -> dict[str, Any]:
    """Return what became of other talk; `misses` lists what was not left alone."""
    world = scenes()[SCENE].world(home())
    answers = []
    for text in other_talk():
        # A planner each: what is said next is no answer to what was asked before.
        with fresh_session() as session:
            session.tell(world)
            answers.append((text, session.say(text)[1]))
    left_alone = [answer.outcome in (ASK, REFUSE) for _, answer in answers]
    plans = [answer.plan for _, answer in answers if answer.outcome == PLAN]
    report = {
        "off_domain_sentences": len(answers),
        "off_domain_rejected_ratio": sum(left_alone) / len(answers),
        "off_domain_asked_back": sum(answer.outcome == ASK for _, answer in answers),
        "off_domain_executed": len(plans),
        "off_domain_moved": sum(moves(plan) for plan in plans if plan is not None),
    }
    return report | ({"off_domain_misses": _misses(answers)} if misses else {})


def _misses(answers: Sequence[tuple[str, Any]]) -> list[str]:
    return [
        f"{text}: {answer.outcome} by {answer.rung}"
        for text, answer in answers
        if answer.outcome not in (ASK, REFUSE)
    ]
