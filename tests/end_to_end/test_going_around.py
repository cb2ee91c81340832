"""What is on no map stands or walks around the robot: judged by MuJoCo's own distances."""

import math
from collections.abc import Iterator
from pathlib import Path

import mujoco
import numpy as np
import pytest

from sim_twin.harness.lockstep_stack import LockstepStack, armed_lockstep

pytestmark = [pytest.mark.gl, pytest.mark.timeout(240)]

ON_THE_WAY = {"x_m": 3.1, "y_m": 2.4, "z_m": 0.0, "yaw_rad": 0.5}
LONGEST_S = 90.0
LOOK_S = 0.1
GAP_M = 0.1
"""The overhang zone and the way to standstill of a robot that creeps."""


@pytest.fixture
def stack(tmp_path: Path, coarse: str) -> Iterator[LockstepStack]:
    with armed_lockstep(tmp_path, profile=coarse) as made:
        yield made


def closest_on_the_way(stack: LockstepStack, text: str, body: str) -> float:
    """Say a command, and return how near a body came to the robot before it had succeeded."""
    engine = stack.lockstep.twin.engine
    model, data = engine.model, engine.data
    ours, theirs = (_solid_geoms(model, name) for name in ("base", body))
    command_id, closest_m, line = stack.give(text=text), 9.0, np.zeros(6)
    while (outcome := stack.outcome(command_id)) is None and stack.lockstep.now_s < LONGEST_S:
        stack.lockstep.run_for(LOOK_S)
        gaps_m = (
            mujoco.mj_geomDistance(model, data, a, b, 2.0, line) for a in ours for b in theirs
        )
        closest_m = min(closest_m, *gaps_m)
    assert outcome is not None
    assert outcome["success"], outcome
    return closest_m


def _solid_geoms(model: mujoco.MjModel, body: str) -> list[int]:
    root = model.body_rootid[model.body(body).id]
    bodies = model.body_rootid[model.geom_bodyid]
    return [int(one) for one in np.flatnonzero((bodies == root) & (model.geom_contype != 0))]


def test_it_goes_around_a_chair(stack: LockstepStack) -> None:
    stack.lockstep.twin.person.put("chair", ON_THE_WAY)
    assert 0.0 < closest_on_the_way(stack, "go to the kitchen", "chair") < 0.6


def test_it_lets_somebody_pass_and_arrives(stack: LockstepStack) -> None:
    stack.lockstep.twin.person.walk([(3.1, 0.9), (3.1, 4.2), (3.1, 3.4)], 0.5)
    assert GAP_M < closest_on_the_way(stack, "go to the kitchen", "person") < 1.0


def test_it_follows_somebody_at_a_distance_and_tells_when_they_are_gone(
    stack: LockstepStack,
) -> None:
    person, now_s = stack.lockstep.twin.person, stack.lockstep.now_s
    followed = stack.give(text="follow me")
    stack.lockstep.run_for(1.5)
    person.walk([(1.7, 2.5), (4.4, 2.3)], 0.3)
    distances_m = []
    while stack.lockstep.now_s < now_s + 10.0:
        stack.lockstep.run_for(0.5)
        robot = stack.lockstep.truth()["robot"]
        distances_m.append(math.dist((robot["x_m"], robot["y_m"]), person.document()["at_m"]))
    assert min(distances_m) > 0.8
    assert max(distances_m[-6:]) < 1.6, distances_m
    person.walk([], 1.0)
    assert stack.lockstep.run_until(lambda: stack.outcome(followed) is not None, 20.0)
    outcome = stack.outcome(followed)
    assert outcome is not None
    assert not outcome["success"]
    assert "I lost whom I followed" in str(outcome)


def test_on_guard_it_reports_who_comes_in_once_and_nobody_else(stack: LockstepStack) -> None:
    person = stack.lockstep.twin.person
    guarding = stack.give(text="keep watch here for ten minutes")
    stack.lockstep.run_for(4.0)
    stack.outcome(guarding)
    assert not stack.has_said("come in")
    person.walk([(5.0, 2.5), (2.2, 2.6), (3.0, 2.6)], 0.7)
    stack.lockstep.run_for(6.0)
    stack.give(text="stop")
    assert stack.lockstep.run_until(lambda: stack.outcome(guarding) is not None, 5.0)
    (told,) = (one["text"] for one in stack.events if one["event"] == "said")
    assert told.startswith("Somebody has come in, ")
    assert told.endswith(" metres ahead of me, in the living room.")
    (action,) = (stack.outcome(guarding) or {})["actions"]
    assert (action["status"], action["data"]["came_in"]) == ("cancelled", 1)
