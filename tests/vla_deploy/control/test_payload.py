"""Hold that a hand which carries something is known by what was told and by what it feels."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from drivers.clock import MonotonicClock
from vla_deploy.control.output.payload import PRESS_M, PRESSING_RATIO, SHORT_OF_GOAL_M, Payload
from vla_deploy.ipc import SharedSpace
from vla_deploy.robots import load_robot

ROBOT = load_robot("butler")
GRIPPER = ROBOT.joint_index["left_gripper"]
SHORT = SHORT_OF_GOAL_M / ROBOT.hands["left"].opening_ratio
PRESS = PRESS_M / ROBOT.hands["left"].opening_ratio


@pytest.fixture
def space(tmp_path: Path) -> SharedSpace:
    return SharedSpace(tmp_path, MonotonicClock())


@pytest.fixture
def payload(space: SharedSpace) -> Iterator[Payload]:
    watched = Payload(ROBOT, space.cell_reader("executor_status"))
    yield watched
    watched.close()


def told(space: SharedSpace, **holding: str | None) -> None:
    space.cell_writer("executor_status").put_document({"state": "idle", "holding": holding})


def felt(
    payload: Payload, *, short_m: float = 0.0, effort: float = 0.0, torque: bool = True
) -> frozenset[str]:
    count = len(ROBOT.joint_names)
    position, setpoint = np.full(count, 0.02), np.full(count, 0.02)
    setpoint[GRIPPER] -= short_m
    efforts = np.zeros(count)
    efforts[GRIPPER] = effort
    return payload.holding(position, setpoint, efforts, np.full(count, torque))


def test_an_idle_robot_of_which_nothing_is_told_holds_nothing(payload: Payload) -> None:
    assert felt(payload) == frozenset()


def test_what_the_executor_told_last_stays_held(space: SharedSpace, payload: Payload) -> None:
    told(space, left="cup", right=None)
    assert felt(payload) == {"left"}


def test_a_hand_that_begins_anew_goes_on_pressing_on_what_it_holds(
    space: SharedSpace, payload: Payload
) -> None:
    position, idle = np.full(len(ROBOT.joint_names), 0.02), np.zeros(len(ROBOT.joint_names))
    assert payload.pressed(position, idle).tolist() == position.tolist()
    told(space, left="cup", right=None)
    begin = payload.pressed(position, idle)
    assert begin[GRIPPER] == pytest.approx(0.02 - PRESS)
    assert np.delete(begin, GRIPPER).tolist() == np.delete(position, GRIPPER).tolist()
    nearly_closed = np.full_like(position, ROBOT.position_min[GRIPPER] + 0.5 * PRESS)
    assert payload.pressed(nearly_closed, idle)[GRIPPER] == ROBOT.position_min[GRIPPER]


def test_a_robot_that_was_just_started_feels_what_its_hand_presses_on(payload: Payload) -> None:
    position, effort = np.full(len(ROBOT.joint_names), 0.02), np.zeros(len(ROBOT.joint_names))
    effort[GRIPPER] = -2 * PRESSING_RATIO
    assert payload.pressed(position, effort)[GRIPPER] == pytest.approx(0.02 - PRESS)
    effort[GRIPPER] = -0.5 * PRESSING_RATIO
    assert payload.pressed(position, effort)[GRIPPER] == 0.02
    effort[GRIPPER] = 2 * PRESSING_RATIO  # opening is no holding
    assert payload.pressed(position, effort)[GRIPPER] == 0.02


def test_a_jaw_on_a_hinge_presses_as_far_between_its_pads_as_fingers_do(space: SharedSpace) -> None:
    koch = load_robot("koch_v1_1")
    (hand,) = koch.hands.values()
    payload = Payload(koch, space.cell_reader("executor_status"))
    told(space, hand="block")
    position = np.full(len(koch.joint_names), 0.5)
    begin = payload.pressed(position, np.zeros_like(position))[koch.joint_index["gripper"]]
    assert hand.opening_m(0.5) - hand.opening_m(begin) == pytest.approx(PRESS_M)
    payload.close()


def test_a_hand_that_the_robot_does_not_have_is_not_held(
    space: SharedSpace, payload: Payload
) -> None:
    told(space, third="cup")
    assert felt(payload) == frozenset()


@pytest.mark.parametrize("effort", [2 * PRESSING_RATIO, -2 * PRESSING_RATIO])
def test_fingers_that_press_short_of_their_goal_hold_something(
    payload: Payload, effort: float
) -> None:
    assert felt(payload, short_m=2 * SHORT, effort=effort) == {"left"}


@pytest.mark.parametrize(
    ("short_m", "effort", "torque"),
    [(0.5 * SHORT, 0.5, True), (0.01, 0.5 * PRESSING_RATIO, True), (0.01, 0.5, False)],
)
def test_fingers_that_do_not_press_hold_nothing(
    payload: Payload, short_m: float, effort: float, torque: bool
) -> None:
    assert felt(payload, short_m=short_m, effort=effort, torque=torque) == frozenset()
