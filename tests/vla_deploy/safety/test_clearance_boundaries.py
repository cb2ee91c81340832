"""Clearances to the last bit: joints that just follow, gaps that just close, boxes just left."""

from dataclasses import replace

import numpy as np
import pytest

from vla_deploy.safety.clearance import (
    CLOSING_M_S,
    JointBounds,
    JointMotion,
    beyond_box,
    nearest_pair,
    stopping,
)

BOUNDS = JointBounds(
    lower=np.array([-9.0, 0.0]),
    upper=np.array([9.0, 0.04]),
    velocity=np.array([1.0, 0.1]),
    acceleration=np.array([4.0, 0.5]),
    jerk=np.array([40.0, 5.0]),
    following=np.array([0.25, 0.002]),
    reaction_s=0.1,
)
RESTING = JointMotion(
    position=np.array([0.5, 0.02]),
    velocity=np.zeros(2),
    setpoint=np.array([0.5, 0.02]),
    setpoint_velocity=np.zeros(2),
    setpoint_acceleration=np.zeros(2),
)
PAIRS = (("hand", "torso"), ("elbow", "torso"))
ORIGIN = np.zeros((2, 3))


@pytest.mark.parametrize(
    ("setpoint", "start"), [(0.75, 0.75), (0.25, 0.25), (0.7500001, 0.5), (0.2499999, 0.5)]
)
def test_a_joint_follows_up_to_its_allowance(setpoint: float, start: float) -> None:
    motion = replace(RESTING, setpoint=np.array([setpoint, 0.02]))
    assert stopping(motion, BOUNDS).start[0] == start


@pytest.mark.parametrize(("velocity", "moves"), [(-0.003, False), (-0.0031, True)])
def test_each_joint_stands_below_a_share_of_its_own_top_speed(velocity: float, moves: bool) -> None:
    lagging = np.array([0.5, 0.03])
    motion = replace(RESTING, setpoint=lagging, velocity=np.array([0.0, velocity]))
    assert bool(stopping(motion, BOUNDS).position[1] < 0.02) is moves


@pytest.mark.parametrize(
    ("start_m", "closing_m_s"), [(CLOSING_M_S, 0.0), (2 * CLOSING_M_S, 2 * CLOSING_M_S)]
)
def test_a_gap_closes_above_the_play_of_distances(start_m: float, closing_m_s: float) -> None:
    found = nearest_pair(PAIRS, np.array([start_m, 1.0]), np.array([0.0, 1.0]), np.zeros(2), 1.0)
    assert found is not None
    assert (found.first, found.closing_m_s) == ("hand", closing_m_s)


@pytest.mark.parametrize(
    ("ahead_m", "subject"), [(CLOSING_M_S, "right"), (2 * CLOSING_M_S, "left")]
)
def test_a_point_leaves_its_box_above_the_play_of_distances(ahead_m: float, subject: str) -> None:
    start = np.array([[0.0, 0.0, 0.0], [0.0, 0.5, 0.0]])
    ahead = np.array([[ahead_m, 0.0, 0.0], [0.0, 0.5, 0.0]])
    found = beyond_box(("left", "right"), start, ahead, ORIGIN, ORIGIN, 1.0)
    assert found is not None
    assert found.subject == subject


def test_one_point_alone_has_its_box_too() -> None:
    out = np.array([[0.0, 0.0, -0.25]])
    found = beyond_box(("hand",), out, out, ORIGIN[:1], ORIGIN[:1], 0.5)
    assert found is not None
    assert (found.excess_m, found.rate_m_s) == (0.25, 0.0)
