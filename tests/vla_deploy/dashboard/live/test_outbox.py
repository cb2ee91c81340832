"""What waits for a client is bounded: values are skipped, lost events are counted."""

import json

from tests.vla_deploy.dashboard.conftest import payload_of
from vla_deploy.dashboard.live.hub import Outbox
from vla_deploy.dashboard.live.message import LiveMessage, LookTime, json_message

NOW = LookTime(run_ns=0, wall_ns=0)


def message(topic: str, number: int, *, queued: bool = False) -> LiveMessage:
    return json_message(topic, 0, NOW, number, queued=queued)


def taken(outbox: Outbox) -> list[tuple[str, object]]:
    texts = [json.loads(payload_of(one)) for one in outbox.take()]
    return [(text["topic"], text["data"]) for text in texts]


def test_a_client_that_comes_late_gets_the_newest_value_only() -> None:
    outbox = Outbox()
    for number in range(1000):
        outbox.put(message("pose", number))
    outbox.put(message("scan", 7))
    assert taken(outbox) == [("pose", 999), ("scan", 7)]
    assert not outbox


def test_events_come_in_order_and_before_values() -> None:
    outbox = Outbox()
    outbox.put(message("pose", 1))
    outbox.put(message("task_event", 2, queued=True))
    outbox.put(message("heard", 3, queued=True))
    assert taken(outbox) == [("task_event", 2), ("heard", 3), ("pose", 1)]


def test_of_too_many_events_the_oldest_are_lost_and_counted_by_topic() -> None:
    outbox = Outbox(most_events=3)
    for number in range(5):
        outbox.put(message("heard" if number == 0 else "task_event", number, queued=True))
    lost = [("lost", {"topic": "heard", "count": 1}), ("lost", {"topic": "task_event", "count": 1})]
    assert taken(outbox) == [*lost, *(("task_event", number) for number in (2, 3, 4))]
    assert taken(outbox) == []


def test_what_is_wanted_no_more_does_not_come() -> None:
    outbox = Outbox()
    outbox.put(message("pose", 1))
    outbox.forget("pose")
    assert not outbox
