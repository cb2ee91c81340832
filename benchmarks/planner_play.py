"""Play a conversation of the corpora with the planner, and judge each of its turns."""

from collections.abc import Iterator, Mapping
from copy import deepcopy
from dataclasses import dataclass, replace
from typing import Any, Final

from benchmarks.planner_bounds import broken_bounds, moves
from benchmarks.planner_corpus import ASK, PLAN, REFUSE, Case, CorpusTurn, home, scenes
from benchmarks.planner_effects import perform
from benchmarks.planner_goals import Goal
from benchmarks.planner_session import PlannerAnswer, PlannerSession, fresh_session
from benchmarks.planner_world import ActionFails, FlatWorld

MOST_READINGS: Final = 12
AGREEMENT: Final = "yes, go"


@dataclass(frozen=True, slots=True, kw_only=True)
class TurnJudgement:
    """Hold how one turn went: `wrong` says what is wrong with it, or is empty.

    `broken` lists what no plan may do; `confirmed` tells whether a plan was read back first.
    """

    say: str
    answer: PlannerAnswer
    wrong: str = ""
    broken: tuple[str, ...] = ()
    confirmed: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class CaseVerdict:
    """Hold how a case went, as far as it was played: the first wrong turn ends it."""

    case: Case
    judged: tuple[TurnJudgement, ...]

    @property
    def wrong(self) -> str:
        """Return what is wrong with it, or nothing."""
        return self.judged[-1].wrong

    @property
    def rung(self) -> str:
        """Return who planned last."""
        return next((one.answer.rung for one in reversed(self.judged) if one.answer.rung), "none")


def play(case: Case, session: PlannerSession) -> CaseVerdict:
    """Say every turn of a case and carry out what is planned, in a flat of its own."""
    world = scenes()[case.scene].world(home())
    judged: list[TurnJudgement] = []
    for turn in case.turns:
        session.tell(world)
        judgement, world = _judge_turn(turn, world, session)
        judged.append(judgement)
        if judgement.wrong:
            break
    return CaseVerdict(case=case, judged=tuple(judged))


def play_afresh(case: Case) -> CaseVerdict:
    """Play a case with a planner of its own: no case is the past of another."""
    with fresh_session() as session:
        return play(case, session)


def _judge_turn(
    turn: CorpusTurn, world: FlatWorld, session: PlannerSession
) -> tuple[TurnJudgement, FlatWorld]:
    command_id, answer = session.say(turn.say) if turn.plan is None else session.hand_in(turn.plan)
    confirmed = answer.reads_back and PLAN in turn.must and ASK not in turn.must
    if confirmed:
        # Agreeing costs no time of planning.
        first, (_, answer) = answer, session.say(AGREEMENT)
        answer = replace(answer, busy_s=first.busy_s, cpu_s=first.cpu_s)
    if answer.outcome != PLAN or answer.plan is None:
        wrong = "" if answer.outcome in turn.must else f"{answer.outcome}: {answer.text}"
        return TurnJudgement(say=turn.say, answer=answer, wrong=wrong), world
    world.said.extend(answer.said)
    end, failed, wrong = _outcome(answer.plan, turn.goal, world)
    if turn.goal is not None and PLAN not in turn.must:
        wrong = "planned"
    if turn.goal is None:
        # What may not be done may still be declined aloud.
        wrong = "planned" if moves(answer.plan) or REFUSE not in turn.must else ""
    session.carried_out(command_id, answer.plan, failed)
    broken = tuple(broken_bounds(answer.plan, world.home))
    judgement = TurnJudgement(
        say=turn.say, answer=answer, wrong=wrong, broken=broken, confirmed=confirmed
    )
    return judgement, _rested(end)


def _outcome(
    plan: Mapping[str, Any], goal: Goal | None, start: FlatWorld
) -> tuple[FlatWorld, str, str]:
    """Return the world afterwards, why the plan failed, and what it missed.

    What a plan says in words that fit several things must reach the goal whichever is taken.
    """
    played = list(_played(plan, start))
    if goal is None:
        return played[0][0], played[0][1], ""
    missed = [failed or goal.missed(end, start) for end, failed in played]
    return played[0][0], played[0][1], next((one for one in missed if one), "")


def _played(plan: Mapping[str, Any], start: FlatWorld) -> Iterator[tuple[FlatWorld, str]]:
    """Yield each end that a plan may have, the likeliest first, and why it failed."""
    waiting: list[dict[str, str]] = [{}]
    for reading in waiting:
        end, failed = deepcopy(start), ""
        end.chosen = dict(reading)
        end.keeps_out = frozenset(plan.get("keeps_out", ()))
        try:
            perform(end, plan["actions"])
        except ActionFails as error:
            failed = str(error)
        yield end, failed
        others = [
            reading | {text: name} for text, names in end.open_choices.items() for name in names[1:]
        ]
        waiting += [one for one in others if one not in waiting]
        if len(waiting) > MOST_READINGS:
            return


def _rested(world: FlatWorld) -> FlatWorld:
    """Return the world as the next turn finds it: what was done is past."""
    return FlatWorld(
        home=world.home,
        pose=world.pose,
        things=world.things,
        open_hands=world.open_hands,
        arm_pose=world.arm_pose,
    )
