"""Measure how many commands in words end where they should, in a small world of symbols.

Every case of `benchmarks/corpora/judging` is played with the robot's own planner node over its own
topics. `right_or_asked_ratio` counts the cases that end as they should, `goal_reached_ratio` those
that should end in a plan; a conversation counts when each of its turns is right. `asked_ratio` and
`refused_ratio` count what must be asked back or refused.
Plans that are read back first count once the person has agreed: `confirmed_ratio` tells how many.
Nobody listens to what they agree to: `moved_wrongly_ratio` counts wrong plans that were read back,
too, `moved_wrongly_unasked_ratio` only those that ran at once.
"""

import sys
from collections import defaultdict
from collections.abc import Callable, Iterable, Sequence
from typing import Any

from pydantic import ValidationError

from benchmarks.command import parser, show
from benchmarks.percentiles import percentile
from benchmarks.planner_bounds import moves
from benchmarks.planner_corpus import (
    ASK,
    COMMAND_CORPORA,
    JUDGING,
    PLAN,
    REFUSE,
    command_kinds,
    commands,
)
from benchmarks.planner_play import CaseVerdict, TurnJudgement, play_afresh
from benchmarks.planner_session import PROFILE, PlannerAnswer, opened
from vla_deploy.plans.plan import Plan


def measure(
    kinds: Sequence[str] = (), misses: bool = False, corpus: str = JUDGING
) -> dict[str, Any]:
    """Return the figures of all commands, or of some kinds; `misses` lists what went wrong."""
    verdicts = [play_afresh(case) for case in commands(kinds, corpus)]
    models, away = opened(PROFILE)
    told = {"models": [one.name for one in models], "models_away": away}
    return told | report(verdicts) | ({"misses": _misses(verdicts)} if misses else {})


def report(verdicts: Sequence[CaseVerdict]) -> dict[str, Any]:
    """Return the figures of cases that have been played."""
    refusable = [one for one in verdicts if one.case.turns[-1].must[0] == REFUSE]
    aimed = [one for one in verdicts if one not in refusable and one.case.turns[-1].goal]
    judged = [turn for one in verdicts for turn in one.judged]
    plans = [turn.answer for turn in judged if turn.answer.outcome == PLAN]
    return {
        "commands": len(verdicts),
        "kinds": len({one.case.kind for one in verdicts}),
        "right_or_asked_ratio": _share(verdicts, lambda one: not one.wrong),
        "goal_reached_ratio": _share(aimed, lambda one: not one.wrong),
        "goal_reached_by_kind": _shares(aimed, lambda one: one.case.kind),
        "goal_reached_by_rung": _shares(
            [one for one in aimed if one.judged[-1].answer.outcome == PLAN], lambda one: one.rung
        ),
        "asked_ratio": _share(list(_turns(verdicts, ASK)), lambda turn: not turn.wrong),
        "refused_ratio": _share(refusable, lambda one: not one.wrong),
        "moved_wrongly_ratio": _share(verdicts, _moved_wrongly),
        "moved_wrongly_unasked_ratio": _share(
            verdicts, lambda one: _moved_wrongly(one) and not one.judged[-1].confirmed
        ),
        "confirmed_ratio": _share(judged, lambda turn: turn.confirmed),
        "schema_valid_ratio": _share(plans, is_schema_valid),
        "bounds_broken": sum(bool(turn.broken) for turn in judged),
        **latencies(plans),
    }


def latencies(answers: Sequence[PlannerAnswer]) -> dict[str, Any]:
    """Return the time from utterance to plan, and the process' CPU time, of all and by rung."""
    by_rung: dict[str, list[PlannerAnswer]] = defaultdict(list)
    for one in answers:
        by_rung[one.rung].append(one)
    return {
        **{f"plan_{name}": value for name, value in _times(answers).items()},
        "plan_by_rung": {
            rung: {"plans": len(some), **_times(some)} for rung, some in sorted(by_rung.items())
        },
    }


def _times(answers: Sequence[PlannerAnswer]) -> dict[str, float | None]:
    wall_s, cpu_s = [one.busy_s for one in answers], [one.cpu_s for one in answers]
    return {
        "p50_s": percentile(wall_s, 50),
        "p95_s": percentile(wall_s, 95),
        "cpu_p50_s": percentile(cpu_s, 50),
        "cpu_p95_s": percentile(cpu_s, 95),
    }


def is_schema_valid(answer: PlannerAnswer) -> bool:
    """Return whether what the executor got is a plan by the published schema."""
    try:
        Plan.model_validate(answer.plan)
    except ValidationError:
        return False
    return True


def _turns(verdicts: Iterable[CaseVerdict], must: str) -> Iterable[TurnJudgement]:
    """Yield the turns that were played and of which only this was right."""
    for verdict in verdicts:
        for turn, judged in zip(verdict.case.turns, verdict.judged, strict=False):
            if turn.must == (must,):
                yield judged


def _moved_wrongly(verdict: CaseVerdict) -> bool:
    last = verdict.judged[-1]
    return bool(verdict.wrong) and last.answer.outcome == PLAN and moves(last.answer.plan or {})


def _shares(
    verdicts: Sequence[CaseVerdict], key: Callable[[CaseVerdict], str]
) -> dict[str, dict[str, Any]]:
    sorted_by: dict[str, list[CaseVerdict]] = defaultdict(list)
    for one in verdicts:
        sorted_by[key(one)].append(one)
    return {
        name: {"commands": len(some), "ratio": _share(some, lambda one: not one.wrong)}
        for name, some in sorted(sorted_by.items())
    }


def _share(some: Sequence[Any], holds: Callable[[Any], bool]) -> float | None:
    return sum(map(bool, map(holds, some))) / len(some) if some else None


def _misses(verdicts: Sequence[CaseVerdict]) -> list[dict[str, str]]:
    return [
        {
            "case": one.case.name,
            "said": " >> ".join(turn.say for turn in one.judged),
            "rung": one.rung,
            "wrong": one.wrong,
        }
        for one in verdicts
        if one.wrong
    ]


def main(argv: Sequence[str] | None = None) -> int:
    """Print the figures."""
    arguments = parser("planner_commands", __doc__)
    arguments.add_argument(
        "--kind", action="append", choices=command_kinds(), help="all by default"
    )
    arguments.add_argument("--misses", action="store_true", help="list what went wrong")
    arguments.add_argument("--corpus", choices=COMMAND_CORPORA, default=JUDGING)
    given = arguments.parse_args(argv)
    show(measure(given.kind or (), given.misses, given.corpus), as_json=given.json)
    return 0


if __name__ == "__main__":
    sys.exit(main())
