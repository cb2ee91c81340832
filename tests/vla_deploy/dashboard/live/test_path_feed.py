"""The way driven is remembered also while nobody looks; the way planned is the executor's."""

import json
from typing import Any

import numpy as np
import pytest

from drivers.clock import NS_PER_S
from sim_twin.contracts.scripted import ManualClock
from tests.vla_deploy.dashboard.conftest import payload_of
from vla_deploy.dashboard.live.feeds import MOST_POINTS, PathFeed
from vla_deploy.dashboard.live.message import LookTime
from vla_deploy.ipc import SharedSpace


class Rig:
    def __init__(self, space: SharedSpace, clock: ManualClock) -> None:
        self.clock = clock
        self.feed = PathFeed(space, clock)
        self._pose = space.cell_writer("pose")
        self._executor = space.cell_writer("executor_status")

    def stand(self, x_m: float, *, state: int = 0) -> None:
        self._pose.put(
            x_m=x_m, y_m=0, yaw_rad=0, match_ratio=1, covariance=np.zeros(9), state=state, doubt=0
        )
        self.feed.follow()

    def plan(self, *points: list[float]) -> None:
        self._executor.put_document({"way_m": points})

    def told(self) -> Any:
        messages = self.feed.look(LookTime(run_ns=self.clock.ns, wall_ns=0))
        return json.loads(payload_of(messages[0]))["data"] if messages else None


@pytest.fixture
def rig(space: SharedSpace, clock: ManualClock) -> Rig:
    return Rig(space, clock)


def test_a_way_is_told_when_it_changes(rig: Rig) -> None:
    assert rig.told() == {"planned": [], "driven": []}
    assert rig.told() is None
    rig.stand(1.0)
    rig.stand(1.01)  # no step
    rig.plan([1.0, 0.0], [2.0, 0.0])
    assert rig.told() == {"planned": [[1.0, 0.0], [2.0, 0.0]], "driven": [[1.0, 0.0]]}
    assert rig.told() is None
    rig.stand(1.2)
    assert rig.told()["driven"] == [[1.0, 0.0], [1.2, 0.0]]
    rig.feed.begin()
    assert rig.told() is not None


def test_the_way_driven_is_bounded_and_keeps_its_end(rig: Rig) -> None:
    for step in range(MOST_POINTS + 10):
        rig.stand(float(step))
    driven = rig.told()["driven"]
    assert (len(driven), driven[-1]) == (MOST_POINTS, [float(MOST_POINTS + 9), 0.0])


def test_a_lost_robot_drives_no_way(rig: Rig) -> None:
    rig.stand(1.0)
    rig.stand(5.0, state=2)
    assert rig.told()["driven"] == [[1.0, 0.0]]


def test_the_plan_of_an_executor_that_is_gone_is_none(rig: Rig) -> None:
    rig.plan([1.0, 0.0])
    rig.clock.ns += 5 * NS_PER_S
    assert rig.told()["planned"] == []
