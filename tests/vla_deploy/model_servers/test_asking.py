import json
from typing import Literal

import pytest
from pydantic import BaseModel, ConfigDict

from vla_deploy.model_servers.asking import StructuredAsker
from vla_deploy.model_servers.chat import Chat, ChatMessage
from vla_deploy.model_servers.errors import (
    AnswerEmpty,
    AnswerInvalid,
    AnswerMalformed,
    AnswerRefused,
    AnswerTruncated,
    ServerFailed,
    ServerRefused,
)


class Colour(BaseModel):
    model_config = ConfigDict(extra="forbid")

    colour: Literal["red", "green"]


CHAT = Chat(system="be brief", messages=(ChatMessage(text="which colour?"),))
RED = json.dumps({"colour": "red"})


@pytest.fixture
def asker(loopback, open_server, clock):
    return StructuredAsker(open_server(loopback.url, clock=clock), Colour)


def test_an_answer_of_the_shape_is_taken_also_from_within_prose(loopback, asker):
    loopback.then(loopback.says(f"It is:\n```json\n{RED}\n```"))
    assert asker.ask(CHAT).colour == "red"
    sent = loopback.heard[0].body
    assert sent["response_format"]["type"] == "json_schema"
    assert sent["messages"][0]["content"].startswith("be brief\n\nAnswer with one JSON object")


@pytest.mark.parametrize("status", [400, 422, 500])
def test_a_server_that_knows_no_schema_is_asked_otherwise_from_then_on(
    loopback, asker, clock, status
):
    def picky(handler):
        form = loopback.heard[-1].body.get("response_format", {}).get("type", "words")
        answer = loopback.says(RED) if form == "json_object" else loopback.sends(status, b"")
        answer(handler)

    loopback.then(picky)
    assert asker.ask(CHAT).colour == "red"
    asked = len(loopback.heard)
    assert asker.ask(CHAT).colour == "red"
    assert (asker.schema_mode, len(loopback.heard) - asked) == ("json_object", 1)
    assert clock.waits_s == []


def test_the_last_way_is_to_ask_in_words(loopback, asker):
    refuse = loopback.sends(400, b"")
    loopback.then(refuse, refuse, loopback.says(RED))
    assert asker.ask(CHAT).colour == "red"
    assert asker.schema_mode == "words"
    assert "response_format" not in loopback.heard[-1].body


def test_a_server_that_refuses_every_way_is_told(loopback, asker):
    loopback.then(loopback.sends(400, {"error": "no"}))
    with pytest.raises(ServerRefused, match="no"):
        asker.ask(CHAT)
    assert (len(loopback.heard), asker.schema_mode) == (3, "json_schema")


def test_a_failure_after_a_way_has_proven_right_changes_nothing(loopback, asker):
    loopback.then(loopback.says(RED), loopback.sends(500, b""))
    asker.ask(CHAT)
    with pytest.raises(ServerFailed):
        asker.ask(CHAT)
    assert asker.schema_mode == "json_schema"


def test_a_wrong_key_is_no_reason_to_ask_otherwise(loopback, asker):
    loopback.then(loopback.sends(401, b""))
    with pytest.raises(ServerRefused, match="key"):
        asker.ask(CHAT)
    assert (asker.schema_mode, len(loopback.heard)) == ("json_schema", 1)


def test_a_wrong_shape_is_sent_back_once_with_its_faults_and_without_images(loopback, open_server):
    picture = Chat(messages=(ChatMessage(text="which colour?", images=(b"jpeg",)),))
    loopback.then(loopback.says('{"colour": "blue"}'), loopback.says(RED))
    asker = StructuredAsker(open_server(loopback.url, vision=True), Colour)
    assert asker.ask(picture).colour == "red"
    turns = loopback.heard[1].body["messages"]
    assert [turn["role"] for turn in turns] == ["system", "user", "assistant", "user"]
    assert turns[1]["content"] == "which colour?"
    assert "colour: Input should be 'red' or 'green'" in turns[3]["content"]


@pytest.mark.parametrize(
    ("text", "error"),
    [
        ('{"colour": "blue"}', AnswerInvalid),
        ('{"colour": "red", "move": "forward"}', AnswerInvalid),
        ("I see a red cup.", AnswerMalformed),
        ('{"colour": "re', AnswerMalformed),
        ("", AnswerEmpty),
        (None, AnswerEmpty),
    ],
)
def test_what_stays_wrong_is_a_typed_error(loopback, asker, text, error):
    loopback.then(loopback.says(text))
    with pytest.raises(error):
        asker.ask(CHAT)
    assert len(loopback.heard) <= 2


def test_a_refusal_and_a_truncated_answer_are_not_repaired(loopback, asker):
    loopback.then(loopback.says(None, refusal="I cannot help"), loopback.says("{", finish="length"))
    with pytest.raises(AnswerRefused, match="I cannot help"):
        asker.ask(CHAT)
    with pytest.raises(AnswerTruncated):
        asker.ask(CHAT)
    assert len(loopback.heard) == 2


def test_the_last_object_of_the_shape_is_the_answer(loopback, asker):
    loopback.then(loopback.says(f'{{"colour": "green"}} no: {RED}, as in {{"colour": "teal"}}'))
    assert asker.ask(CHAT).colour == "red"
