"""Hold the rules of starting, taking over, cancelling and stopping motions."""

import numpy as np
import pytest

from vla_deploy.control.motion.axes import Axes, AxisLimits
from vla_deploy.control.motion.motions import Ending, MotionResult, MotionSet
from vla_deploy.control.motion.profile_motion import plan_motion

PERIOD_S = 0.004
LIMITS = AxisLimits(velocity=np.full(3, 2.0), acceleration=np.full(3, 8.0), jerk=np.full(3, 80.0))
LEFT, RIGHT, BOTH = np.array([0, 1]), np.array([2]), np.array([1, 2])


@pytest.fixture
def motions() -> MotionSet:
    return MotionSet(LIMITS)


def go(motions: MotionSet, motion_id: int, axes: Axes, target: float) -> list[MotionResult]:
    start = motions.state.of(axes)
    curve = plan_motion(start, np.full(len(axes), target), LIMITS.of(axes))
    return motions.start(motion_id, axes, curve)


def run(motions: MotionSet, seconds: float) -> list[MotionResult]:
    return [
        result for _ in range(round(seconds / PERIOD_S)) for result in motions.advance(PERIOD_S)
    ]


def test_a_motion_ends_as_done_on_its_target(motions: MotionSet) -> None:
    assert go(motions, 7, LEFT, 0.5) == []
    assert motions.active_ids == [7]
    assert run(motions, 2.0) == [MotionResult(motion_id=7, ending=Ending.DONE)]
    assert motions.state.position.tolist() == [0.5, 0.5, 0.0]
    assert motions.at_rest


def test_motions_of_different_joints_run_side_by_side(motions: MotionSet) -> None:
    go(motions, 1, LEFT, 0.5)
    go(motions, 2, RIGHT, -0.5)
    assert motions.active_ids == [1, 2]
    assert {result.motion_id for result in run(motions, 2.0)} == {1, 2}
    assert motions.state.position.tolist() == [0.5, 0.5, -0.5]


def test_a_motion_that_loses_a_joint_ends_as_cancelled_and_its_rest_ramps(
    motions: MotionSet,
) -> None:
    go(motions, 1, LEFT, 1.0)
    run(motions, 0.3)
    before = motions.state.position.copy()
    assert motions.state.velocity[0] > 0.5
    (result,) = go(motions, 2, BOTH, -0.2)
    assert (result.motion_id, result.ending) == (1, Ending.CANCELLED)
    assert "motion 2" in result.reason
    motions.advance(PERIOD_S)
    assert np.abs(motions.state.position - before).max() < 2.0 * PERIOD_S
    run(motions, 3.0)
    assert motions.state.position[1:].tolist() == [-0.2, -0.2]
    assert before[0] < motions.state.position[0] < 1.0
    assert motions.at_rest


def test_cancel_ramps_to_rest_and_reports_once(motions: MotionSet) -> None:
    go(motions, 1, LEFT, 1.0)
    run(motions, 0.3)
    assert [r.ending for r in motions.cancel(1)] == [Ending.CANCELLED]
    assert motions.active_ids == []
    assert motions.state.velocity.any()
    assert run(motions, 2.0) == []
    assert motions.at_rest
    assert motions.state.position[0] < 1.0


def test_cancelling_what_has_ended_does_nothing(motions: MotionSet) -> None:
    assert motions.cancel(99) == []


def test_a_stop_ends_all_motions_with_its_reason_and_ramps(motions: MotionSet) -> None:
    go(motions, 1, LEFT, 1.0)
    go(motions, 2, RIGHT, 1.0)
    run(motions, 0.3)
    speeds = []
    results = motions.stop("estop")
    assert [(r.motion_id, r.ending, r.reason) for r in results] == [
        (1, Ending.STOPPED, "estop"),
        (2, Ending.STOPPED, "estop"),
    ]
    while not motions.at_rest:
        motions.advance(PERIOD_S)
        speeds.append(motions.state.velocity.max())
    assert len(speeds) < 0.6 / PERIOD_S
    assert speeds[-1] == 0.0
    assert np.abs(np.diff(speeds)).max() <= 8.0 * PERIOD_S * 1.001


def test_a_stop_at_rest_moves_nothing(motions: MotionSet) -> None:
    assert motions.stop("estop") == []
    assert motions.at_rest


def test_placing_puts_the_setpoints_of_some_joints_at_rest(motions: MotionSet) -> None:
    motions.place(np.array([0.1, 0.2, 0.3]), np.array([True, False, True]))
    assert motions.state.position.tolist() == [0.1, 0.0, 0.3]
    assert not motions.state.velocity.any()
