"""Missions of the whole robot: side by side or one after the other, and over a restart."""

import json
from collections.abc import Callable
from typing import Any

import pytest

from sim_twin.campaigns.missions import EIGHT, one_after_another
from sim_twin.harness.lockstep_stack import LockstepStack
from vla_deploy.ipc import topics

pytestmark = [pytest.mark.gl, pytest.mark.timeout(240)]


def carried_out(stack: LockstepStack, objectives: list[dict[str, Any]]) -> float:
    """Return how long a mission takes, in seconds."""
    clock = stack.lockstep.context.clock
    begun_ns = clock.now_ns()
    mission_id = stack.give(mission={"objectives": objectives})
    assert stack.lockstep.run_until(lambda: stack.outcome(mission_id) is not None, 120.0)
    outcome = stack.outcome(mission_id)
    assert outcome is not None
    assert outcome["success"], outcome
    return (clock.now_ns() - begun_ns) / 1e9


def test_eight_objectives_side_by_side_are_faster_and_come_to_the_same_end(
    make_stack: Callable[..., LockstepStack], coarse: str
) -> None:
    took_s, ends = [], []
    for objectives in (list(EIGHT), one_after_another()):
        stack = make_stack(profile=coarse)
        stack.arm()
        took_s.append(carried_out(stack, objectives))
        stack.lockstep.run_for(1.0)
        ends.append(stack.lockstep.truth()["joints"])
    assert took_s[0] < 0.8 * took_s[1], took_s
    for name, joint in ends[0].items():
        assert joint["position"] == pytest.approx(ends[1][name]["position"], abs=0.02), name


def test_a_mission_goes_on_where_it_was_when_the_planner_is_killed(
    coarse_stack: LockstepStack,
) -> None:
    stack = coarse_stack
    mission_id = stack.give(text="turn left 90 degrees; look left; turn right 90 degrees")

    def has_begun() -> bool:
        stack.outcome(mission_id)
        return any(one["command_id"] == f"{mission_id}/o1.s1" for one in stack.events)

    assert stack.lockstep.run_until(has_begun, 20.0)
    stack.lockstep.kill(stack.planner)
    stack.lockstep.run_for(6.0)  # the first objective ends meanwhile
    stack.restart_planner()
    assert stack.lockstep.run_until(lambda: stack.outcome(mission_id) is not None, 60.0)
    outcome = stack.outcome(mission_id)
    assert outcome is not None
    assert outcome["success"], outcome
    given = {one["command_id"] for one in stack.events if one["event"] == "plan"}
    assert given == {f"{mission_id}/{name}.s1" for name in ("o1", "o2", "o3")}
    shown = stack.document(topics.MISSIONS)["missions"][0]
    assert (shown["state"], shown["mission_id"]) == ("completed", mission_id)
    assert "lost" not in json.dumps(shown)
