"""A robot that does not know where it is looks for itself, and says so when that fails."""

from pathlib import Path

import numpy as np
import pytest

from drivers.clock import NS_PER_S
from vla_deploy.client.place_state import Doubt, PlaceState
from vla_deploy.ipc import Announcer, CellReader, ClaimBook, SharedSpace
from vla_deploy.navigation.path_planning import PathPlanner
from vla_deploy.robots import load_robot
from vla_deploy.robots.floor_pose import Pose2D
from vla_deploy.robots.maps.grid_map import GridMap
from vla_deploy.skills.context import Skill, SkillContext
from vla_deploy.skills.errors import TryAgain
from vla_deploy.skills.link import SkillLink
from vla_deploy.skills.movements.bearings import (
    SEARCH_RATE_RAD_S,
    SEARCH_S,
    SEARCH_TURN_RAD,
    find_myself,
)
from vla_deploy.skills.movements.drive import BLOCKED_TIMEOUT_S, drive_to

STEP_S = 0.1


class Told:
    """Tell pose and scan at each step of a skill, on a clock of its own, in an empty room."""

    def __init__(self, tmp_path: Path) -> None:
        self.at_ns = 5 * NS_PER_S
        self.state, self.doubt = PlaceState.TRACKING, Doubt.NONE
        space = SharedSpace(tmp_path / "ipc", self)
        self._pose, self._scan = space.cell_writer("pose"), space.cell_writer("scan")
        self._asked: CellReader = space.cell_reader("base_command")
        grid = GridMap(
            resolution_m=0.05, origin_m=(0.0, 0.0), blocked=np.zeros((80, 80), dtype=np.bool_)
        )
        robot = load_robot("butler")
        self.context = SkillContext(
            robot=robot,
            link=SkillLink(space, self, robot),
            planner=PathPlanner(grid, 0.2),
            arms={},
            say=lambda _: None,
            voice=Announcer(space, "speak", self),
            claims=ClaimBook(space, self),
        )
        self.tell()

    def now_ns(self) -> int:
        return self.at_ns

    def sleep_until(self, deadline_ns: int) -> None:
        self.at_ns = max(self.at_ns, deadline_ns)

    def tell(self) -> None:
        self._pose.put(
            x_m=2.0,
            y_m=2.0,
            yaw_rad=0.0,
            match_ratio=1.0,
            covariance=(0.0,) * 9,
            state=self.state,
            doubt=self.doubt,
        )
        self._scan.put(range_m=np.full(360, 5.0, dtype=np.float32), beam_age_s=())

    def asked(self) -> tuple[float, float]:
        sample = self._asked.latest()
        assert sample is not None
        return float(sample.data["v_m_s"]), float(sample.data["w_rad_s"])

    def run(self, skill: Skill, seconds: float) -> list[tuple[float, float]]:
        """Step the skill for a while; return what it asked of the base, to its end."""
        asked = []
        for _ in range(round(seconds / STEP_S)):
            self.tell()
            if next(skill, "over") == "over":
                break
            asked.append(self.asked())
            self.at_ns += round(STEP_S * NS_PER_S)
        return asked


@pytest.fixture
def told(tmp_path: Path) -> Told:
    return Told(tmp_path)


def test_a_robot_that_knows_its_place_loses_no_time(told: Told) -> None:
    assert told.run(find_myself(told.context), 1.0) == []


def test_a_lost_robot_waits_then_turns_on_the_spot_then_says_that_it_is_lost(told: Told) -> None:
    told.state, told.doubt = PlaceState.LOST, Doubt.AMBIGUOUS
    skill = find_myself(told.context)
    assert set(told.run(skill, SEARCH_S)) == {(0.0, 0.0)}
    assert told.run(skill, 1.0)[-1] == (0.0, SEARCH_RATE_RAD_S)
    with pytest.raises(TryAgain, match="do not know where I am: several places"):
        told.run(skill, SEARCH_TURN_RAD / SEARCH_RATE_RAD_S)
    assert told.asked() == (0.0, 0.0)


def test_drive_goals_of_a_lost_robot_move_nothing_forward(told: Told) -> None:
    told.state = PlaceState.LOST
    goal = Pose2D(x_m=3.0, y_m=2.0, yaw_rad=0.0)
    skill = drive_to(told.context, goal)
    rested = told.run(skill, SEARCH_S)
    assert set(rested) == {(0.0, 0.0)}
    turned = told.run(skill, 0.5 * SEARCH_TURN_RAD / SEARCH_RATE_RAD_S)
    assert set(turned) == {(0.0, SEARCH_RATE_RAD_S)}
    told.state = PlaceState.TRACKING
    driven = told.run(skill, 2.0)
    assert driven[-1][0] > 0.1


def test_a_robot_that_becomes_unsure_on_the_way_stops_and_gives_up_with_the_reason(
    told: Told,
) -> None:
    skill = drive_to(told.context, Pose2D(x_m=3.0, y_m=2.0, yaw_rad=0.0))
    assert told.run(skill, 2.0)[-1][0] > 0.1
    told.state, told.doubt = PlaceState.UNSURE, Doubt.THROUGH_WALLS
    held = told.run(skill, BLOCKED_TIMEOUT_S)
    assert set(held) == {(0.0, 0.0)}
    with pytest.raises(TryAgain, match="through walls"):
        told.run(skill, 1.0)
