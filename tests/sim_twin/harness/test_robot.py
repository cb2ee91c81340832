"""A robot is led to where it is armed from every state, and a wait ends in time."""

from collections.abc import Callable
from typing import Any

import pytest

from drivers.clock import NS_PER_S
from sim_twin.contracts.scripted import ManualClock
from sim_twin.harness.robot import RobotFailed, RobotUnderTest
from vla_deploy.client.link import RobotLink
from vla_deploy.ipc import Topic, topics

STARTING_S = 2.0
NEXT = {
    ("stopped", "reset"): "disarmed",
    ("fault", "reset"): "disarmed",
    ("disarmed", "arm"): "armed",
}


class ScriptedLink(RobotLink):
    """Pass on an operator's acts."""

    def __init__(self, operate: Callable[[str], None]) -> None:
        self.operate = operate  # type: ignore[method-assign,assignment]


class ScriptedRobot(RobotUnderTest):
    """Follow an act at once, and nothing else; leave `silent` and `arming` after a while."""

    def __init__(self, state: str, *, obeys: bool = True) -> None:
        self.clock = ManualClock(NS_PER_S)
        self.acts: list[str] = []
        self._state = state
        self._obeys = obeys

    def document(self, topic: Topic[Any] | str, age_limit_s: float | None = None) -> dict[str, Any]:
        assert topic is topics.CONTROL_STATUS
        if self.clock.now_ns() >= (1 + STARTING_S) * NS_PER_S:
            self._state = {"silent": "disarmed", "arming": "armed"}.get(self._state, self._state)
        return {} if self._state == "silent" else {"state": self._state}

    @property
    def link(self) -> RobotLink:
        return ScriptedLink(self._follow)

    def _follow(self, act: str) -> None:
        self.acts.append(act)
        if self._obeys:
            self._state = NEXT[self._state, act]

    def close(self) -> None:
        """Have nothing to end."""


@pytest.mark.parametrize(
    ("state", "acts"),
    [
        ("armed", []),
        ("disarmed", ["arm"]),
        ("stopped", ["reset", "arm"]),
        ("fault", ["reset", "arm"]),
        ("arming", []),
        ("silent", ["arm"]),
    ],
)
def test_a_robot_is_armed_from_wherever_it_is(state: str, acts: list[str]) -> None:
    robot = ScriptedRobot(state)
    robot.arm()
    assert robot.state() == "armed"
    assert robot.acts == acts


def test_what_has_no_effect_is_done_again_until_it_is_given_up() -> None:
    robot = ScriptedRobot("stopped", obeys=False)
    with pytest.raises(RobotFailed, match="not armed after 3 s"):
        robot.arm(3.0)
    assert set(robot.acts) == {"reset"}
    assert 5 <= len(robot.acts) <= 7


def test_a_wait_ends_as_soon_as_it_is_so_or_in_time() -> None:
    robot = ScriptedRobot("armed")
    began_ns = robot.clock.now_ns()
    assert robot.wait_until(lambda: robot.since_s(began_ns) > 1.0, 5.0)
    assert robot.since_s(began_ns) < 1.1
    assert not robot.wait_until(lambda: False, 2.0)
    assert robot.since_s(began_ns) < 3.2
