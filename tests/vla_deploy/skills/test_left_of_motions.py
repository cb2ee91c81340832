"""A drive or a turn that ends early tells what is left of it, so that nothing is done twice."""

from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from drivers.clock import NS_PER_S
from vla_deploy.client.place_state import PlaceState
from vla_deploy.skills.link import PATIENCE_S, POSE_AGE_S
from vla_deploy.skills.movements.drive import BLOCKED_TIMEOUT_S

if TYPE_CHECKING:
    from conftest import Executor

STEP_NS = NS_PER_S // 20
X_M, Y_M, YAW_RAD = 1.0, 2.0, 0.0
MOVE = {"id": "a1", "skill": "move", "parameters": {"distance_m": 1.0, "speed_m_s": 0.2}}
TURN = {"id": "a2", "skill": "turn", "parameters": {"angle_rad": 5.0}}
LOOK = {"id": "a4", "skill": "look_at", "parameters": {"object": "bottle"}}


class Base:
    """An executor whose base is where the test puts it, without a lidar, and held by control."""

    def __init__(self, executor: "Executor") -> None:
        self.clock, self.space, self.node = executor.clock, executor.space, executor.node
        self.events, self.give = executor.events, executor.give

    def step(self, ahead_m: float = 0.0, turned_rad: float = 0.0) -> dict[str, Any] | None:
        """Let one step pass with the base somewhere; return the setback, if one is told."""
        self.space.cell_writer("pose").put(
            x_m=X_M + ahead_m,
            y_m=Y_M,
            yaw_rad=float(np.angle(np.exp(1j * (YAW_RAD + turned_rad)))),
            match_ratio=1.0,
            covariance=np.zeros(9),
            state=PlaceState.TRACKING,
            doubt=0,
        )
        return self.wait()

    def wait(self) -> dict[str, Any] | None:
        """Let one step pass of which perception tells nothing."""
        self.clock.ns += STEP_NS
        status = {"state": "armed", "estop_latched": False, "cause": "keep_out_zone",
                  "detail": "", "blocked": ["turn_left", "turn_right"]}  # fmt: skip
        self.space.cell_writer("control_status").put_document(status)
        self.space.cell_writer("planner_status").put_document({})
        self.node.step()
        told = [event.payload for event in self.events.drain()]
        return next((one for one in told if one["event"] == "setback"), None)

    def until_setback(self, **where: float) -> dict[str, Any]:
        for _ in range(round((BLOCKED_TIMEOUT_S + 1.0) * NS_PER_S / STEP_NS)):
            told = self.step(**where)
            if told is not None:
                return told
        raise AssertionError("the motion did not fail")


@pytest.fixture
def base(executor: "Executor") -> Base:
    return Base(executor)


def test_a_drive_that_was_blocked_tells_the_rest_of_the_way(base: Base) -> None:
    base.give(MOVE)
    base.step()
    assert base.until_setback(ahead_m=0.4)["left"] == {"a1": {"distance_m": 0.6}}


def test_a_turn_of_more_than_half_a_circle_tells_the_rest(base: Base) -> None:
    base.give(TURN)
    for share in range(5):
        base.step(turned_rad=share)
    assert base.until_setback(turned_rad=4.0)["left"] == {"a2": {"angle_rad": 1.0}}


def test_a_motion_that_ends_since_something_else_failed_tells_the_rest_too(base: Base) -> None:
    pause = {"id": "a3", "skill": "wait", "parameters": {"duration_s": 0.2}}
    base.give(TURN, pause, {**LOOK, "depends_on": ["a3"]})
    told = [base.step(turned_rad=min(0.1 * number, 0.3)) for number in range(20)]
    setback = next(one for one in told if one is not None)
    assert setback["action_id"] == "a4"
    assert setback["left"] == {"a2": {"angle_rad": 4.7}}


def test_a_motion_that_never_began_is_left_whole(base: Base) -> None:
    base.give(MOVE, {**TURN, "depends_on": ["a1"]})
    base.step()
    assert base.until_setback()["left"].keys() == {"a1"}


def test_how_far_a_robot_got_whose_place_nobody_tells_is_not_known(base: Base) -> None:
    base.give(MOVE)
    base.step()
    base.step(ahead_m=0.1)
    told = [base.wait() for _ in range(round((POSE_AGE_S + PATIENCE_S + 0.5) * NS_PER_S / STEP_NS))]
    (setback,) = [one for one in told if one is not None]
    assert setback["left"] == {"a1": {}}


def test_other_actions_have_nothing_left(base: Base) -> None:
    base.give(LOOK)
    assert base.until_setback()["left"] == {}
