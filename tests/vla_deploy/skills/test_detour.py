"""A way is led around what is told to stand in it; perception is the test's to play."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from drivers.clock import NS_PER_S
from tests.vla_deploy.skills.conftest import StepClock
from vla_deploy.ipc import SharedSpace, topics
from vla_deploy.robots.floor_pose import Points, Pose2D
from vla_deploy.skills.context import SkillContext
from vla_deploy.skills.link import SkillLink
from vla_deploy.skills.movements.detour import WAIT_S, Detour

HERE = Pose2D(1.0, 2.0, 0.0)
START, GOAL = (1.0, 2.0), (4.0, 2.0)
CRATE = [(2.5, y_m) for y_m in np.arange(1.8, 2.2, 0.05)]
SIDE_STEP_M = 0.25


class Perception:
    """Publish what a test says that stands beside the map."""

    def __init__(self, run_dir: Path) -> None:
        self.clock = StepClock()
        self.space = SharedSpace(run_dir, self.clock)
        self._writer = self.space.cell_writer(topics.LIVE_OBSTACLES)
        self._scene = self.space.cell_writer(topics.SCENE)

    def tell(self, points: list[tuple[float, float]], *movers: tuple[float, ...]) -> None:
        self.clock.ns += NS_PER_S // 10
        x_m, y_m = np.array(points, dtype=np.float64).reshape(-1, 2).T
        moving = np.array(movers, dtype=np.float64).reshape(-1, 4).T
        names = ("mover_x_m", "mover_y_m", "mover_vx_m_s", "mover_vy_m_s")
        fields = {
            name: np.pad(row, (0, topics.MOVERS - len(row)))
            for name, row in zip(names, moving, strict=True)
        }
        padded = {
            name: np.pad(column, (0, topics.OBSTACLE_POINTS - len(column)))
            for name, column in (("x_m", x_m), ("y_m", y_m))
        }
        self._writer.put(count=len(x_m), **padded, mover_count=len(movers), **fields)

    def see_chair(self, x_m: float, y_m: float) -> None:
        chair = {
            "class": "chair",
            "position_m": [x_m, y_m],
            "width_m": 0.4,
            "top_m": 0.9,
            "confidence": 0.8,
        }
        self._scene.put_document(
            {"stamp_ns": self.clock.ns, "objects": [], "bystanders": [chair]}  # type: ignore[typeddict-item]
        )


@pytest.fixture
def perception(tmp_path: Path) -> Iterator[Perception]:
    made = Perception(tmp_path)
    yield made
    made.space.close()


@pytest.fixture
def detour(perception: Perception, context: SkillContext) -> Detour:
    link = SkillLink(perception.space, perception.clock, context.robot)
    return Detour(replace(context, link=link), np.array((START, GOAL)))


def nearest_m(way: Points, points: list[tuple[float, float]]) -> float:
    samples = np.vstack([np.linspace(way[i], way[i + 1], 40) for i in range(len(way) - 1)])
    return float(np.linalg.norm(samples[:, None] - np.array(points)[None], axis=2).min())


def test_what_stands_beside_the_way_or_beyond_it_changes_nothing(
    perception: Perception, detour: Detour
) -> None:
    assert not detour.revise(HERE)
    perception.tell([(2.5, 3.0), (1.0, 0.5)])
    assert not detour.revise(HERE)
    assert detour.closed_by == ""


def test_the_way_leads_around_what_stands_in_it_and_ends_where_it_did(
    perception: Perception, detour: Detour
) -> None:
    perception.tell(CRATE)
    assert detour.revise(HERE)
    assert nearest_m(detour.way, CRATE) > SIDE_STEP_M
    assert detour.way[-1] == pytest.approx(GOAL)
    perception.tell(CRATE)
    assert not detour.revise(HERE), "the new way is clear"


def test_who_walks_there_is_waited_for_and_then_passed_further_off(
    perception: Perception, detour: Detour
) -> None:
    walker = (2.5, 2.0, 0.0, 0.4)
    for _ in range(round(WAIT_S * 10)):
        perception.tell([], walker)
        assert not detour.revise(HERE)
        assert detour.closed_by == "somebody is in the way"
    perception.tell([], walker)
    assert detour.revise(HERE)
    assert nearest_m(detour.way, [walker[:2]]) > 2.0 * SIDE_STEP_M


def test_who_has_gone_by_is_forgotten(perception: Perception, detour: Detour) -> None:
    perception.tell([], (2.5, 2.0, 0.0, 0.7))
    detour.revise(HERE)
    perception.tell([], (2.5, 4.0, 0.0, 0.7))
    assert not detour.revise(HERE)
    assert detour.closed_by == ""


def test_somebody_who_leaves_no_room_is_who_closes_the_way(
    perception: Perception, detour: Detour
) -> None:
    gap_m = 0.5
    wall = [(2.5, y_m) for y_m in np.arange(-1.0, 6.0, 0.05) if abs(y_m - 2.0) > gap_m]
    for _ in range(round(WAIT_S * 10) + 2):
        perception.tell(wall[:200], (2.5, 2.0, 0.0, 0.0))
        assert not detour.revise(HERE)
    assert detour.closed_by.startswith("the way is closed by somebody, ")


@pytest.mark.parametrize(("is_seen", "name"), [(False, "something"), (True, "a chair")])
def test_what_closes_the_way_is_named(
    perception: Perception, detour: Detour, *, is_seen: bool, name: str
) -> None:
    wall = [(2.5, y_m) for y_m in np.arange(-1.0, 6.0, 0.05)]
    if is_seen:
        perception.see_chair(2.6, 2.1)
    perception.tell(wall[:200])
    assert not detour.revise(HERE)
    assert detour.closed_by.startswith(f"the way is closed by {name}, ")
    perception.tell([])
    assert not detour.revise(HERE)
    assert detour.closed_by == ""
