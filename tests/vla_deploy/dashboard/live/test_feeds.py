"""Live topics of the schema table, the table of all topics, and the robot's path."""

import json
from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest

from drivers.clock import NS_PER_S
from sim_twin.contracts.scripted import ManualClock
from tests.vla_deploy.dashboard.conftest import payload_of
from vla_deploy.dashboard.live.feeds import MOST_POINTS, PathFeed, RingFeed, TopicTable, topic_feeds
from vla_deploy.dashboard.live.message import LiveFeed, LiveMessage, LookTime
from vla_deploy.ipc import BY_NAME, TOPICS, SharedSpace, TopicKind

NAMES = ("shoulder", "elbow")


@pytest.fixture
def feeds(space: SharedSpace) -> Mapping[str, LiveFeed]:
    return {feed.topic: feed for feed in topic_feeds(space, NAMES)}


def told(message: LiveMessage) -> Any:
    text = json.loads(payload_of(message))
    assert text["topic"] == message.topic
    return text


def now(clock: ManualClock) -> LookTime:
    return LookTime(run_ns=clock.ns, wall_ns=clock.ns + 100 * NS_PER_S)


def test_every_cell_and_ring_has_a_feed(feeds: Mapping[str, LiveFeed]) -> None:
    expected = {topic.name for topic in TOPICS if topic.kind in (TopicKind.CELL, TopicKind.RING)}
    assert set(feeds) == expected
    assert all(feed.period_s <= 0.5 for feed in feeds.values())
    assert feeds["joint_state"].period_s == pytest.approx(0.1)
    assert feeds["scan"].period_s == pytest.approx(0.2)
    assert feeds["process_table"].period_s == pytest.approx(0.5)
    assert feeds["missions"].period_s == pytest.approx(0.5)  # large, and told on change


def test_a_document_passes_as_it_is_with_its_age_and_once(
    feeds: Mapping[str, LiveFeed], space: SharedSpace, clock: ManualClock
) -> None:
    feed = feeds["control_status"]
    assert feed.look(now(clock)) == ()
    clock.ns = 5 * NS_PER_S
    space.cell_writer("control_status").put_document({"state": "armed", "why": "é {}"})
    clock.ns += NS_PER_S // 4
    (message,) = feed.look(now(clock))
    text = told(message)
    assert text["data"] == {"state": "armed", "why": "é {}"}
    assert (text["stamp_s"], text["age_s"]) == (105.0, 0.25)
    assert feed.look(now(clock)) == ()
    feed.begin()
    assert len(feed.look(now(clock))) == 1


def test_joints_come_with_their_names_and_no_longer_than_they_are(
    feeds: Mapping[str, LiveFeed], space: SharedSpace, clock: ManualClock
) -> None:
    numbers = [0.123456789, -1.0]
    space.cell_writer("joint_state").put(
        joint_count=2,
        position=numbers,
        velocity=numbers,
        setpoint=numbers,
        effort_ratio=[0.1, np.nan],
        age_s=[0, 0],
        error=[0, 32],
        torque_enabled=[1, 0],
    )
    data = told(feeds["joint_state"].look(now(clock))[0])["data"]
    assert data["names"] == list(NAMES)
    assert data["position"] == [0.1235, -1.0]
    assert (data["effort_ratio"], data["error"]) == ([0.1, None], [0, 32])


def test_a_scan_is_told_in_millimetres_without_the_age_of_its_beams(
    feeds: Mapping[str, LiveFeed], space: SharedSpace, clock: ManualClock
) -> None:
    space.cell_writer("scan").put(range_m=[1.23456] * 360, beam_age_s=[0.05] * 360)
    data = told(feeds["scan"].look(now(clock))[0])["data"]
    assert data == {"range_m": [1.235] * 360}


def test_what_is_not_on_the_map_is_told_with_who_moves(
    feeds: Mapping[str, LiveFeed], space: SharedSpace, clock: ManualClock
) -> None:
    cell = space.cell_writer("live_obstacles")
    cell.put(
        count=2,
        x_m=[1.0, 1.05],
        y_m=[2.0, 2.0],
        mover_count=1,
        mover_x_m=[3.0],
        mover_y_m=[4.0],
        mover_vx_m_s=[0.5],
        mover_vy_m_s=[0.0],
    )
    (message,) = feeds["live_obstacles"].look(now(clock))
    data = told(message)["data"]
    assert (data["x_m"], data["mover_x_m"], data["mover_vx_m_s"]) == ([1.0, 1.05], [3.0], [0.5])


def test_events_begin_now_and_none_is_skipped(
    feeds: Mapping[str, LiveFeed], space: SharedSpace, clock: ManualClock
) -> None:
    ring = space.ring_writer("task_event")
    ring.publish({"event": "old"})
    feed = feeds["task_event"]
    feed.begin()
    for number in range(3):
        ring.publish({"event": number})
    messages = feed.look(now(clock))
    assert [told(message)["data"]["event"] for message in messages] == [0, 1, 2]
    assert all(message.queued for message in messages)


def rows(table: TopicTable, clock: ManualClock) -> dict[str, Any]:
    (message,) = table.look(LookTime(run_ns=clock.ns, wall_ns=clock.ns))
    return {row["topic"]: row for row in json.loads(payload_of(message))["data"]["topics"]}


def test_every_declared_topic_has_a_row_before_anything_is_written(
    space: SharedSpace, clock: ManualClock
) -> None:
    told = rows(TopicTable(space, {}), clock)
    assert told.keys() == {topic.name for topic in TOPICS}
    row = told["base_state"]
    assert (row["owner"], row["declared_hz"], row["deadline_s"]) == ("control", 250, 0.1)
    assert (row["rate_hz"], row["age_s"], row["lost"]) == (None, None, 0)


def test_rate_and_age_follow_the_writer_and_a_pause_in_looking_is_not_counted(
    space: SharedSpace, clock: ManualClock
) -> None:
    table, writer = TopicTable(space, {}), space.cell_writer("base_command")
    for _ in range(40):
        writer.put(v_m_s=0.0, w_rad_s=0.0)
        clock.ns += NS_PER_S // 20
        told = rows(table, clock)["base_command"]
    assert told["rate_hz"] == pytest.approx(20.0)
    assert told["age_s"] == pytest.approx(0.05)
    clock.ns += 100 * NS_PER_S
    table.begin()
    told = rows(table, clock)["base_command"]
    assert (told["rate_hz"], told["age_s"]) == (None, pytest.approx(100.05))


def test_a_ring_tells_what_was_overwritten_before_it_was_read(
    space: SharedSpace, clock: ManualClock
) -> None:
    ring = RingFeed(BY_NAME["motion_result"], space.ring_reader("motion_result", from_start=False))
    table, writer = TopicTable(space, {"motion_result": ring}), space.ring_writer("motion_result")
    for _ in range(BY_NAME["motion_result"].slots + 5):
        writer.publish({})
    ring.look(LookTime(run_ns=0, wall_ns=0))
    assert rows(table, clock)["motion_result"]["lost"] == 5


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
