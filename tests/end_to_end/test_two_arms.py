"""Two arms on one table: each hand works in its half, and the arms never meet."""

import math
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from sim_twin.campaigns.missions import OFFER
from sim_twin.harness.lockstep_stack import LockstepControl, LockstepStack, armed_lockstep
from vla_deploy.control.judging.body_shapes import BodyShapes
from vla_deploy.manipulation.grasps import hand_down
from vla_deploy.manipulation.kinematics import ArmKinematics

PAIR = "so101_pair"
HANDS = {"red_block": "left", "blue_block": "right"}
"""Which hand reaches which block, of seed 0."""


class Between:
    """The least distance between the arms that was seen, as physics has them."""

    def __init__(self, robot: LockstepControl) -> None:
        self._robot, self._shapes = robot, BodyShapes(robot.robot)
        sides = [{name.partition("_")[0] for name in pair} for pair in self._shapes.self_pairs]
        self._between = [pair == {"left", "right"} for pair in sides]
        self.least_m = math.inf

    def look(self) -> None:
        joints = self._robot.lockstep.truth()["joints"]
        positions = np.array([joints[one]["position"] for one in self._robot.robot.joint_names])
        distances_m = self._shapes.distances(positions)[0]
        self.least_m = min(self.least_m, float(distances_m[self._between].min()))

    def run_for(self, duration_s: float) -> None:
        for _ in range(round(duration_s / 0.1)):
            self._robot.lockstep.run_for(0.1)
            self.look()


@pytest.fixture
def control(tmp_path: Path) -> Iterator[LockstepControl]:
    made = LockstepControl(tmp_path, robot=PAIR)
    made.arm()
    yield made
    made.close()


def test_an_arm_that_is_sent_to_where_the_other_is_stops_before_it(
    control: LockstepControl,
) -> None:
    between, robot = Between(control), control.robot
    positions = np.array([robot.poses["ready"][name] for name in robot.joint_names])
    control.go(robot.poses["ready"])
    between.run_for(3.0)
    for side in ("right", "left"):
        there = ArmKinematics(robot, side).solve(
            hand_down((0.19, 0.0, 0.06), yaw_rad=math.pi / 2), positions
        )
        joints = robot.group(f"{side}_arm").joints
        control.go({name: float(there.positions[robot.joint_index[name]]) for name in joints})
        between.run_for(3.0)
    limit_m = robot.protection.clearance.self_m
    assert limit_m < between.least_m < 0.03, "the right hand is there, the left one came near"
    assert not control.lockstep.twin.hazards.found


@pytest.mark.slow
@pytest.mark.gl
def test_each_hand_takes_what_lies_in_its_half_and_hands_it_over(tmp_path: Path) -> None:
    with armed_lockstep(tmp_path, robot=PAIR) as stack:
        between = Between(stack)
        for block, hand in HANDS.items():
            _said(stack, between, f"pick up the {block.replace('_', ' ')}")
            held = {name for name, kind in _holding(stack).items() if kind}
            assert hand in held
        assert set(stack.lockstep.truth()["held"]) == set(HANDS)
        _said(stack, between, "put the red block into the bowl")
        assert stack.lockstep.inside("red_block", "bowl")["inside"]
        command = stack.give(text="hand over the blue block")
        assert stack.lockstep.run_until(lambda: _offers(stack, command), 25.0)
        stack.lockstep.run_for(2.0)
        assert stack.outcome(command) is None, "nobody pulls yet"
        person = stack.lockstep.twin.person
        person.take("blue_block")
        assert stack.lockstep.run_until(lambda: stack.outcome(command) is not None, 30.0)
        assert person.taken == ("blue_block",)
        assert between.least_m > stack.robot.protection.clearance.self_m
        assert stack.state() == "armed"


def _said(stack: LockstepStack, between: Between, text: str) -> None:
    command = stack.give(text=text)
    for _ in range(60):
        between.run_for(1.0)
        if (ended := stack.outcome(command)) is not None:
            assert ended["success"], ended
            return
    pytest.fail(f"{text}: not done within a minute")


def _offers(stack: LockstepStack, command: str) -> bool:
    assert stack.outcome(command) is None
    return stack.has_said(OFFER)


def _holding(stack: LockstepStack) -> dict[str, str | None]:
    sample = stack.space.cell_reader("executor_status").latest()
    assert sample is not None
    return dict(sample.document()["holding"])
