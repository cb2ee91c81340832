"""The hazard watch reports what is dangerous, and nothing in ordinary work."""

import math
from pathlib import Path

import mujoco
import numpy as np
import pytest

from drivers.clock import NS_PER_S
from sim_twin.harness.lockstep_stack import LockstepControl
from sim_twin.physics.hazards import MOST_TILT_RAD, HazardWatch
from sim_twin.twin import Twin
from vla_deploy.robots import load_robot

ROBOT = load_robot("butler")


@pytest.fixture
def twin() -> Twin:
    return Twin(ROBOT)


def kinds(watch: HazardWatch) -> set[tuple[str, str]]:
    return {(hazard.kind, hazard.part) for hazard in watch.found}


def run(twin: Twin, steps: int) -> None:
    for _ in range(steps):
        twin.step()


def test_a_robot_that_rests_and_reaches_is_no_hazard(tmp_path: Path) -> None:
    stack = LockstepControl(tmp_path)
    stack.arm()
    watch = stack.lockstep.twin.hazards
    stack.go({"left_elbow": 1.9})
    stack.lockstep.run_for(2.0)
    assert watch.found == ()
    stack.close()


def test_a_falling_cup_is_seen_and_named(twin: Twin) -> None:
    watch = twin.hazards
    twin.engine.place("red_cup", 1.0, 3.0, 0.5, 0.0)
    run(twin, 250)
    assert kinds(watch) == {("fall", "red_cup")}
    assert watch.found[0].worst > watch.found[0].limit


def test_a_cup_that_is_let_go_a_centimetre_above_the_floor_is_none(twin: Twin) -> None:
    watch = twin.hazards
    rests_m = 0.0475
    twin.engine.place("red_cup", 1.0, 3.0, rests_m + 0.01, 0.0)
    run(twin, 250)
    assert watch.found == ()


def test_a_joint_too_fast_and_one_beyond_its_stop_are_seen(twin: Twin) -> None:
    watch, model, data = twin.hazards, twin.engine.model, twin.engine.data
    fast = 1.15 * float(ROBOT.velocity_max[ROBOT.joint_names.index("left_elbow")])
    data.qvel[model.joint("left_elbow").dofadr[0]] = fast
    data.qpos[model.joint("head_pan").qposadr[0]] = model.joint("head_pan").range[1] + 0.05
    watch.step(twin.now_ns)
    assert {("joint speed", "left_elbow"), ("joint range", "head_pan")} <= kinds(watch)


def test_a_hand_behind_its_workspace_is_seen(twin: Twin) -> None:
    watch, model, data = twin.hazards, twin.engine.model, twin.engine.data
    box = ROBOT.protection.workspaces["left"]
    turn = model.joint("left_shoulder_yaw").qposadr[0]
    data.qpos[model.joint("left_elbow").qposadr[0]] = 0.0
    data.qpos[model.joint("left_shoulder_pitch").qposadr[0]] = -1.0
    angles = np.linspace(*model.joint("left_shoulder_yaw").range, 60)
    for look, angle in enumerate(angles, start=1):
        data.qpos[turn] = angle
        mujoco.mj_forward(model, data)
        watch.step(look * NS_PER_S)
    (hazard,) = (found for found in watch.found if found.kind == "workspace")
    assert hazard.part == "left"
    assert hazard.worst < float(np.subtract(box.max_m, box.min_m).max())


@pytest.mark.parametrize(
    ("dof", "speed", "kind"), [(0, 0.7, "base speed"), (5, 2.0, "turning speed")]
)
def test_a_base_too_fast_is_seen(twin: Twin, dof: int, speed: float, kind: str) -> None:
    model = twin.engine.model
    root = int(model.jnt_dofadr[model.body_jntadr[model.body("base").id]])
    watch = twin.hazards
    twin.engine.data.qvel[root + dof] = speed
    watch.step(twin.now_ns)
    assert (kind, "base") in kinds(watch)


def test_a_robot_that_tips_is_seen(twin: Twin) -> None:
    watch, model, data = twin.hazards, twin.engine.model, twin.engine.data
    place = int(model.jnt_qposadr[model.body_jntadr[model.body("base").id]])
    half = MOST_TILT_RAD / 2.0 + 0.01
    data.qpos[place + 3 : place + 7] = (math.cos(half), math.sin(half), 0.0, 0.0)
    run(twin, 4)
    assert ("tilt", "base") in kinds(watch)


def test_beginning_again_clears_the_findings(twin: Twin) -> None:
    watch = twin.hazards
    twin.engine.place("red_cup", 1.0, 3.0, 0.5, 0.0)
    run(twin, 250)
    assert watch.found
    watch.begin()
    assert watch.document() == []
