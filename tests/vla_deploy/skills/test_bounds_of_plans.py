"""How long an action may take, and whether another plan is asked for, is up to the robot file."""

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from drivers.clock import NS_PER_S
from vla_deploy.client.place_state import PlaceState

if TYPE_CHECKING:
    from conftest import Executor

STEP_S = 0.05
MOVE = {"id": "a1", "skill": "move", "parameters": {"distance_m": 1.0}}
WAIT = {"id": "a1", "skill": "wait", "parameters": {"duration_s": 3.0}}


class StandingBase:
    """An executor whose base stays where it is."""

    def __init__(self, executor: "Executor") -> None:
        self.executor, self.clock = executor, executor.clock
        self.control_state = "armed"
        space = self.executor.space
        self._pose = space.cell_writer("pose")
        self._control = space.cell_writer("control_status")
        self._planner = space.cell_writer("planner_status")

    def until(self, event: str, within_s: float = 60.0) -> tuple[dict[str, Any], float]:
        """Return an event of that kind, and after what time it was told."""
        began_ns = self.clock.ns
        while self.clock.ns - began_ns < within_s * NS_PER_S:
            self.clock.ns += round(STEP_S * NS_PER_S)
            self._pose.put(
                x_m=1.0, y_m=2.0, yaw_rad=0.0, match_ratio=1.0, covariance=np.zeros(9),
                state=PlaceState.TRACKING, doubt=0,
            )  # fmt: skip
            status = {"state": self.control_state, "estop_latched": False, "cause": "",
                      "detail": "", "blocked": []}  # fmt: skip
            self._control.put_document(status)
            self._planner.put_document({})
            self.executor.node.step()
            for told in self.executor.events.drain():
                if told.payload["event"] == event:
                    return told.payload, (self.clock.ns - began_ns) / NS_PER_S
        raise AssertionError(f"no {event}")


@pytest.fixture
def held(new_executor: Callable[..., "Executor"]) -> Callable[..., StandingBase]:
    return lambda **given: StandingBase(new_executor(**given))


def test_an_action_ends_at_the_robots_own_time_out(held) -> None:
    robot = held(action_timeout_s=1.0)
    robot.executor.give(MOVE)
    setback, after_s = robot.until("setback")
    assert setback["error"] == "move took longer than 1 s"
    assert after_s == pytest.approx(1.0, abs=0.3)


def test_waiting_lasts_as_long_as_it_was_asked_for(held) -> None:
    robot = held(action_timeout_s=1.0)
    robot.executor.give(WAIT)
    finished, after_s = robot.until("finished")
    assert finished["success"]
    assert after_s == pytest.approx(3.0, abs=0.3)


def test_a_robot_that_makes_no_further_plan_asks_for_none(held) -> None:
    robot = held(action_timeout_s=1.0, further_plans=0)
    robot.executor.give(MOVE)
    finished, _ = robot.until("finished")
    assert finished["error"] == "move took longer than 1 s"


def test_another_plan_is_waited_for_as_long_as_the_planner_may_take(held) -> None:
    robot = held(plan_within_s=40.0, action_timeout_s=1.0)
    robot.executor.give(MOVE)
    robot.until("setback")
    finished, after_s = robot.until("finished")
    assert "the planner has no other plan in time" in finished["error"]
    assert after_s == pytest.approx(42.0, abs=0.3)


def test_a_stop_ends_what_waits_for_another_plan(held) -> None:
    robot = held(plan_within_s=40.0, action_timeout_s=1.0)
    robot.executor.give(MOVE)
    robot.until("setback")
    robot.control_state = "stopped"
    finished, after_s = robot.until("finished")
    assert "reset and arm" in finished["error"]
    assert after_s < 0.3
