from collections.abc import Iterator
from pathlib import Path

import pytest

from drivers.clock import NS_PER_S
from vla_deploy.ipc import SharedSpace
from vla_deploy.navigation.follower import Twist
from vla_deploy.robots import load_robot
from vla_deploy.skills.errors import TryAgain
from vla_deploy.skills.link import PATIENCE_S, POSE_AGE_S, RobotLink


class SteppedClock:
    """Stand still until a test moves it."""

    def __init__(self) -> None:
        self.at_ns = 5 * NS_PER_S

    def now_ns(self) -> int:
        """Return the time."""
        return self.at_ns

    def sleep_until(self, deadline_ns: int) -> None:
        """Step to a moment."""
        self.at_ns = max(self.at_ns, deadline_ns)

    def step(self, seconds: float) -> None:
        """Step by a while."""
        self.at_ns += round(seconds * NS_PER_S)


@pytest.fixture
def clock() -> SteppedClock:
    return SteppedClock()


@pytest.fixture
def space(tmp_path: Path, clock: SteppedClock) -> Iterator[SharedSpace]:
    opened = SharedSpace(tmp_path / "ipc", clock)
    yield opened
    opened.close()


def test_a_pose_that_grows_old_is_waited_for_and_then_given_up(
    space: SharedSpace, clock: SteppedClock
) -> None:
    link = RobotLink(space, clock, load_robot("butler"))
    before_it_ever_spoke = link.is_blind
    poses = space.cell_writer("pose")
    poses.put(x_m=1.0, y_m=2.0, yaw_rad=0.5, match_ratio=1.0)
    assert (link.pose.x_m, link.is_blind) == (1.0, False)
    clock.step(POSE_AGE_S + 0.1)
    silent = link.is_blind
    with pytest.raises(TryAgain, match="pose"):
        _ = link.pose
    clock.step(PATIENCE_S)
    assert (before_it_ever_spoke, silent, link.is_blind) == (False, True, False)


def test_a_halt_rests_the_base_only_if_it_was_driven(
    space: SharedSpace, clock: SteppedClock
) -> None:
    link = RobotLink(space, clock, load_robot("butler"))
    commands = space.cell_reader("base_command")
    link.halt()
    assert commands.latest() is None
    link.drive(Twist(0.3, 0.1))
    link.halt()
    sample = commands.latest()
    assert sample is not None
    assert (sample.data["v_m_s"], sample.data["w_rad_s"]) == (0.0, 0.0)
