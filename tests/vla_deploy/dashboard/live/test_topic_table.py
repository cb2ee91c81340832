"""Rates and ages of every topic are those of its writer."""

import json
from typing import Any

import pytest

from drivers.clock import NS_PER_S
from sim_twin.contracts.scripted import ManualClock
from tests.vla_deploy.dashboard.conftest import payload_of
from vla_deploy.dashboard.live.feeds import RingFeed, TopicTable
from vla_deploy.dashboard.live.message import LookTime
from vla_deploy.ipc import BY_NAME, TOPICS, SharedSpace


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
