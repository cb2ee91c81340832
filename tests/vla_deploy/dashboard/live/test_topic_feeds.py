"""Every topic of the schema table is told as it is declared, once per change."""

import json
from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest

from drivers.clock import NS_PER_S
from sim_twin.contracts.scripted import ManualClock
from tests.vla_deploy.dashboard.conftest import payload_of
from vla_deploy.dashboard.live.feeds import topic_feeds
from vla_deploy.dashboard.live.message import LiveFeed, LiveMessage, LookTime
from vla_deploy.ipc import TOPICS, Kind, SharedSpace

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
    expected = {topic.name for topic in TOPICS if topic.kind in (Kind.CELL, Kind.RING)}
    assert set(feeds) == expected
    assert all(feed.period_s <= 0.5 for feed in feeds.values())
    assert feeds["joint_state"].period_s == pytest.approx(0.1)
    assert feeds["scan"].period_s == pytest.approx(0.2)
    assert feeds["process_table"].period_s == pytest.approx(0.5)


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
