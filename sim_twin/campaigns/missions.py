"""Carry missions out on the lock-step twin, and judge them by what MuJoCo knows.

documents/SEED      the mission of the seed documents: go, fetch and hand over, clean, report
side_by_side/SEED   eight objectives with two arms, against the same one after the other
paused/PHASE        the main job paused for 5 s in one of its phases, against the same unpaused
"""

import argparse
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import Any, Final

from drivers.clock import NS_PER_S, MonotonicClock
from sim_twin.campaigns.evidence import Watch, unwatched
from sim_twin.campaigns.processes import played
from sim_twin.campaigns.report import CampaignCase, CampaignReport, crash_is_failure
from sim_twin.campaigns.selection import chosen
from sim_twin.harness.lockstep_stack import LockstepStack, armed_lockstep

COUNT: Final = 3
MOST_SHARE: Final = 0.8
"""Of the time one after the other that side by side may take."""
MOST_APART_M: Final = 0.03
PAUSE_S: Final = 5.0
REST_RAD_S: Final = 0.02
DOCUMENTS: Final = (
    "go to the kitchen; find the red cup and bring it to me; clean the coffee table; report"
)
CUP: Final = "red_cup"
TABLE: Final = "coffee_table"
OFFER: Final = "Pull a little"
"""What the robot says when somebody may take what it holds."""
MAIN_JOB: Final = "pick up the red cup and put it in the box"
PHASES: Final = ("find_object", "navigate_to", "pick_up", "place")
_LIMIT_S: Final = 400.0
_Played = tuple[list[str], dict[str, Any]]
"""What was wrong, and figures."""


def _of_arm(name: str, arm: str, *skills: str) -> dict[str, Any]:
    pose = {"pose": "tuck"}
    actions = [
        {
            "id": skill,
            "skill": skill,
            "parameters": {"arm": arm} | (pose if skill == "move_arm" else {}),
            "depends_on": [before] if before else [],
        }
        for before, skill in pairwise((None, *skills))
    ]
    return {"id": name, "actions": actions}


EIGHT: Final[tuple[dict[str, Any], ...]] = (
    {"id": "turn", "words": "turn left 90 degrees"},
    _of_arm("left", "left", "move_arm"),
    _of_arm("right", "right", "move_arm"),
    _of_arm("left_hand", "left", "open_gripper", "close_gripper"),
    _of_arm("right_hand", "right", "open_gripper", "close_gripper"),
    {"id": "look", "words": "look left"},
    {"id": "say", "words": "say I am at work"},
    {"id": "face", "words": "look ahead", "depends_on": ["turn", "look"]},
)


@dataclass(slots=True, kw_only=True)
class _Ending:
    """Hold how a command ended, how long it took, and what the physics knows then."""

    outcome: dict[str, Any]
    took_s: float
    truth: dict[str, Any]
    inside: dict[str, Any] = field(default_factory=dict)

    @property
    def failures(self) -> list[str]:
        """Return why it did not succeed."""
        reason = self.outcome.get("error") or self.outcome.get("reason") or "no end in time"
        return [] if self.outcome.get("success") else [f"failed: {reason}"]


def run(options: argparse.Namespace, tell: Callable[[str], None]) -> CampaignReport:
    """Play every case, several at a time; `options.count` seeds, 3 unless given."""
    seeds = range(options.seed, options.seed + (COUNT if options.count is None else options.count))
    names = [f"documents/{seed}" for seed in seeds]
    names += [f"side_by_side/{seed}" for seed in seeds]
    names += [f"paused/{phase}" for phase in PHASES]
    mine = chosen(names, options.only, str)
    cases = played(partial(play, seed=options.seed), mine, options.workers, tell, 1)
    shares = [one.figures["share"] for one in cases if "share" in one.figures]
    summary = {"longest share of the time one after the other": max(shares)} if shares else {}
    return CampaignReport(campaign="missions", cases=cases, summary=summary)


@crash_is_failure
def play(name: str, seed: int, watch: Watch = unwatched) -> CampaignCase:
    """Play the case of that name; `seed` is that of the paused jobs."""
    kind, _, which = name.partition("/")
    clock = MonotonicClock()
    begun_ns = clock.now_ns()
    match kind:
        case "documents":
            failures, figures = _documents(int(which), watch)
        case "side_by_side":
            failures, figures = _side_by_side(int(which), watch)
        case _:
            failures, figures = _paused(which, seed, watch)
    seconds = (clock.now_ns() - begun_ns) / NS_PER_S
    return CampaignCase(name=name, failures=tuple(failures), figures=figures, seconds=seconds)


def _documents(seed: int, watch: Watch) -> _Played:
    with _robot(seed, watch) as stack:
        on_table = _on(stack, TABLE) - {CUP}
        begun_s = stack.lockstep.now_s
        command_id = stack.give(text=DOCUMENTS)
        failures = [] if _takes_what_is_offered(stack, command_id) else ["no offer"]
        ending = _end_of(stack, command_id, begun_s)
        failures += ending.failures
        if ending.truth["held"]:
            failures.append(f"still held: {', '.join(ending.truth['held'])}")
        if stack.lockstep.twin.person.taken != (CUP,):
            failures.append("the person has not got the red cup")
        if left := on_table & _on(stack, TABLE):
            failures.append(f"still on the cleaned table: {', '.join(sorted(left))}")
        return failures, {"took_s": ending.took_s} | _counts(ending)


def _takes_what_is_offered(stack: LockstepStack, command_id: str) -> bool:
    """Run until the robot offers the cup, take it, and return whether there was an offer."""
    stack.lockstep.run_until(
        lambda: stack.outcome(command_id) is not None or stack.has_said(OFFER), _LIMIT_S
    )
    if not stack.has_said(OFFER):
        return False
    stack.lockstep.twin.person.take(CUP)
    return True


def _on(stack: LockstepStack, furniture: str) -> set[str]:
    """Return the things whose middle is over a piece of furniture, and above it."""
    data = stack.lockstep.twin.engine.data
    middle, size = data.geom(furniture).xpos, stack.lockstep.twin.engine.model.geom(furniture).size
    return {
        name
        for name, one in stack.lockstep.truth()["objects"].items()
        if all(abs(one["position_m"][axis] - middle[axis]) < size[axis] for axis in (0, 1))
        and one["position_m"][2] > middle[2]
    }


def _side_by_side(seed: int, watch: Watch) -> _Played:
    endings = []
    for objectives in (list(EIGHT), one_after_another()):
        with _robot(seed, watch) as stack:
            endings.append(_carried_out(stack, mission={"objectives": objectives}))
    beside, after = endings
    share = beside.took_s / after.took_s
    failures = [*beside.failures, *after.failures]
    if share > MOST_SHARE:
        failures.append(f"took {share:.2f} of the time one after the other")
    apart_rad = max(
        abs(joint["position"] - after.truth["joints"][name]["position"])
        for name, joint in beside.truth["joints"].items()
    )
    if apart_rad > MOST_APART_M:
        failures.append(f"a joint ended {apart_rad:.3f} rad elsewhere")
    figures = {"beside_s": beside.took_s, "after_s": after.took_s, "share": share}
    return failures, figures | {"apart_rad": apart_rad}


def _paused(phase: str, seed: int, watch: Watch) -> _Played:
    with _robot(seed, watch) as stack:
        plain = _carried_out(stack, text=MAIN_JOB)
        plain.inside = stack.lockstep.inside("red_cup", "box")
    with _robot(seed, watch) as stack:
        failures: list[str] = []
        command_id = stack.give(text=MAIN_JOB)
        begun_s = stack.lockstep.now_s
        if not stack.lockstep.run_until(lambda: _is_in(stack, command_id, phase), _LIMIT_S):
            return [f"{phase} never began"], {}
        stack.lockstep.run_for(1.0)
        moved_rad = _pause(stack)
        if moved_rad > REST_RAD_S:
            failures.append(f"a joint moved by {moved_rad:.3f} rad in the pause")
        ending = _end_of(stack, command_id, begun_s)
        inside = stack.lockstep.inside("red_cup", "box")
    failures += [*plain.failures, *ending.failures]
    if not inside["inside"]:
        failures.append("the red cup is not in the box")
    apart_m = abs(inside["placement_error_m"] - plain.inside["placement_error_m"])
    if apart_m > MOST_APART_M:
        failures.append(f"placed {1000 * apart_m:.0f} mm from where it was without a pause")
    figures = {"plain_s": plain.took_s, "paused_s": ending.took_s, "apart_m": apart_m}
    placed = {"placement_error_m": inside["placement_error_m"]}
    return failures, figures | placed | {"moved_rad": moved_rad}


def _pause(stack: LockstepStack) -> float:
    """Pause, and return how far any joint moved in the pause once it had come to rest."""
    stack.give(pause=True)
    stack.lockstep.run_for(2.0)
    before = stack.lockstep.truth()["joints"]
    stack.lockstep.run_for(PAUSE_S - 2.0)
    after = stack.lockstep.truth()["joints"]
    stack.give(pause=False)
    moved = (abs(after[name]["position"] - before[name]["position"]) for name in before)
    return float(max(moved))


def one_after_another() -> list[dict[str, Any]]:
    """Return the eight objectives, each after the one before it."""
    first = EIGHT[0]
    return [first, *(one | {"depends_on": [before["id"]]} for before, one in pairwise(EIGHT))]


@contextmanager
def _robot(seed: int, watch: Watch) -> Iterator[LockstepStack]:
    with (
        tempfile.TemporaryDirectory(prefix="vla-") as folder,
        armed_lockstep(Path(folder), seed=seed) as stack,
    ):
        watch(stack)
        yield stack


def _carried_out(stack: LockstepStack, **content: Any) -> _Ending:
    begun_s = stack.lockstep.now_s
    return _end_of(stack, stack.give(**content), begun_s)


def _end_of(stack: LockstepStack, command_id: str, begun_s: float) -> _Ending:
    stack.lockstep.run_until(lambda: stack.outcome(command_id) is not None, _LIMIT_S)
    took_s = stack.lockstep.now_s - begun_s
    stack.lockstep.run_for(1.0)
    outcome = stack.outcome(command_id) or {}
    return _Ending(outcome=outcome, took_s=took_s, truth=stack.lockstep.truth())


def _is_in(stack: LockstepStack, command_id: str, skill: str) -> bool:
    stack.outcome(command_id)
    return any(
        event["event"] == "action" and event["skill"] == skill and event["status"] == "active"
        for event in stack.events
    )


def _counts(ending: _Ending) -> dict[str, Any]:
    summary = ending.outcome.get("summary", {})
    return {"actions": summary.get("total_actions"), "success_rate": summary.get("success_rate")}
