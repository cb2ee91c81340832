"""Every topic that carries JSON names the type of its payload."""

import json

import pytest

from sim_twin.contracts.payloads import faults_of
from vla_deploy.ipc import BY_NAME, TOPICS, TopicKind
from vla_deploy.ipc.claim_book import _document_of
from vla_deploy.ipc.claims import Book, Claim, ask, declare
from vla_deploy.ipc.memory.layout import is_document
from vla_deploy.ipc.ros_goals import GoalAnswer, GoalKind, GoalRequest, GoalState

GOAL = {"kind": "goal", "motion_id": 7, "targets": {"a": 0}, "speed_ratio": 0.5}
REQUEST = GoalRequest(
    request_id="1", kind=GoalKind.NAVIGATE, server="nav", holder="h", parts=("base",), timeout_s=9.0
)


def test_what_carries_json_has_a_payload_and_nothing_else_has() -> None:
    for topic in TOPICS:
        carries_json = topic.kind is TopicKind.RING or is_document(topic)
        assert (topic.payload is not None) == carries_json, topic.name


@pytest.mark.parametrize(
    ("topic", "message", "faults"),
    [
        ("motion_command", GOAL, []),
        ("motion_command", GOAL | {"effort_ratio": {"a": 1.0}}, []),
        ("motion_command", GOAL | {"speed": 1.0}, [".speed: unknown"]),
        ("motion_command", {**GOAL, "targets": {"a": True}}, [".targets.a: expected"]),
        ("operator", {"act": "arm", "source": "page"}, [".reason: missing"]),
        ("operator", {"act": "fly", "source": "page", "reason": ""}, [".act: expected"]),
        ("budget_stop", {"stop": 0, "reason": ""}, [".stop: expected"]),
        ("ros_request", {"act": "permit", "request_id": "1", "reason": ""}, []),
    ],
)
def test_a_message_has_the_keys_and_values_of_its_type(
    topic: str, message: dict, faults: list[str]
) -> None:
    found = list(faults_of(message, BY_NAME[topic].payload, ""))
    assert len(found) == len(faults)
    assert all(one.startswith(fault) for one, fault in zip(found, faults, strict=True))


def test_a_dataclass_is_sent_with_all_its_fields_and_no_others() -> None:
    book = ask(declare(Book(), {"arm": 1}, 0), Claim(holder="a1", wants={"arm": 1}), 0)
    answer = GoalAnswer(request_id="1", state=GoalState.LOST)
    for topic, message in (
        ("claims", _document_of(book)),
        ("ros_request", REQUEST.document()),
        ("ros_answer", answer.document()),
    ):
        assert list(faults_of(json.loads(json.dumps(message)), BY_NAME[topic].payload, topic)) == []
