"""A real server on loopback plans rightly, wrongly, unsurely, late, or not at all."""

import json
from concurrent.futures import ThreadPoolExecutor
from threading import Event

import numpy as np
import pytest

from drivers.clock import MonotonicClock
from vla_deploy.model_servers.calls.exchange import Exchange
from vla_deploy.model_servers.server import ModelServer
from vla_deploy.model_servers.settings import ServerSettings
from vla_deploy.planning.chat_models.chat_model import ServedModel
from vla_deploy.planning.chat_models.plan_answer import answer_for
from vla_deploy.planning.errors import Ambiguous, CannotBeDone, Declined
from vla_deploy.planning.interfaces import Aid
from vla_deploy.planning.planner import checked
from vla_deploy.plans.errors import UnknownPlace
from vla_deploy.runtime.deadline import Deadline

TIDY = "make it tidy here"
GO = {"skill": "navigate_to", "place": "kitchen", "yaw_rad": None}
NOWHERE = {"skill": "navigate_to", "place": "narnia"}


def answer(*steps: dict, **changes) -> str:
    told = {
        "reasoning": "that is what was asked",
        "question": None,
        "feasible": True,
        "steps": list(steps),
        "confidence": 0.95,
    }
    return json.dumps(told | changes)


@pytest.fixture
def served(loopback):
    """Return a back end that asks the loopback server."""

    def served(check=checked, **changes) -> ServedModel:
        declared = {
            "api": "openai_compatible",
            "url": loopback.url,
            "model": "tiny",
            "location": "local",
            "max_attempts": 1,
        }
        settings = ServerSettings.model_validate(declared | changes)
        server = ModelServer(
            "bench", settings, None, Exchange(settings), MonotonicClock(), lambda: 0.5
        )
        shape = answer_for(("charging_station", "kitchen"), ("lamp",))
        return ServedModel(server, "butler", shape, check)

    return served


def within(given_s: float = 20.0, recall: Event | None = None) -> Deadline:
    return Deadline.within(MonotonicClock(), given_s, recall)


def places_of(proposal) -> list[str]:
    return [action.parameters["place"] for action in proposal.plan.actions]


def said(loopback, number: int = -1) -> str:
    content = loopback.heard[number].body["messages"][1]["content"]
    return content if isinstance(content, str) else content[-1]["text"]


@pytest.mark.parametrize(
    ("trusted", "confidence", "is_unsure"),
    [(True, 0.95, False), (True, 0.4, True), (False, 1, True)],
)
def test_the_answer_is_the_plan(loopback, served, ask, trusted, confidence, is_unsure):
    """How sure a server is, is its own claim: until its owner trusts it, a person agrees first."""
    loopback.then(loopback.says(answer(GO, confidence=confidence)))
    back_end = served(trust_plans=trusted)
    proposal = back_end.propose(ask(TIDY), within())
    assert places_of(proposal) == ["kitchen"]
    assert proposal.back_end == "server bench"
    assert (proposal.confidence, proposal.is_read_back) == (confidence, is_unsure)
    told = back_end.document()
    assert (told["tokens_in"], told["tokens_out"], told["answers"]) == (11, 7, 1)
    assert len(loopback.heard) == 1
    body = loopback.heard[0].body
    assert body["response_format"]["json_schema"]["strict"] is True
    assert '"red"' in said(loopback)
    assert said(loopback).endswith('<command>"make it tidy here"</command>')


def test_a_model_whose_plan_is_refused_is_told_why_once(loopback, served, ask):
    loopback.then(loopback.says(answer(NOWHERE)), loopback.says(answer(GO)))
    proposal = served().propose(ask(TIDY), within())
    assert places_of(proposal) == ["kitchen"]
    wish = loopback.heard[1].body["messages"][-1]["content"]
    assert "refused: " in wish
    assert 'I do not know the place "narnia"' in wish


def test_the_number_of_calls_is_bounded_whatever_the_model_does(loopback, served, ask):
    loopback.then(loopback.says(answer(NOWHERE)))
    with pytest.raises(UnknownPlace, match="narnia"):
        served().propose(ask(TIDY), within())
    assert len(loopback.heard) == 2


@pytest.mark.parametrize(
    "document",
    [
        {"actions": [{"action": "go_to", "params": {"location": "kitchen"}}]},
        {"plan": [{"id": "1", "action": "navigate", "parameters": {"location": "kitchen"}}]},
        {"primitives": [{"action_type": "navigate_to", "parameters": {"place": "kitchen"}}]},
        {"steps": [{"skill": "go_to", "place": "kitchen"}], "confidence": 0.9},
    ],
)
def test_every_dialect_is_read_also_in_prose(loopback, served, ask, document):
    loopback.then(loopback.says(f"Sure! Here you go:\n```json\n{json.dumps(document)}\n```\nBye."))
    assert places_of(served().propose(ask(TIDY), within())) == ["kitchen"]


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("I would go to the kitchen.", "expected a JSON object"),
        ('{"steps": "go"}', "wrong shape"),
        ('{"steps": [3]}', "wrong shape"),
        (answer(*[GO] * 500), "at most 100"),
        (answer(GO, confidence="very"), "confidence"),
        ('{"a":' * 5000 + "1" + "}" * 5000, "expected a JSON object"),
        ("", "no text"),
    ],
)
def test_what_cannot_be_read_is_declined_with_the_reason(loopback, served, ask, text, reason):
    loopback.then(loopback.says(text))
    with pytest.raises(Declined, match=reason):
        served().propose(ask(TIDY), within())


@pytest.mark.parametrize(
    ("reply", "reason"),
    [
        (lambda server: server.sends(200, b" " * 2_000_000), "at most 1024 KB"),
        (lambda server: server.sends(500, b""), "HTTP 500"),
        (lambda server: server.sends(401, b""), "refuses the key"),
        (lambda server: server.says(None, refusal="I will not"), "I will not"),
        (lambda server: server.raw(b"HTTP/1.1 200 OK\r\nContent-Le"), "no whole HTTP answer"),
        (lambda server: server.says('{"steps": [', finish="length"), "ran out of tokens"),
    ],
)
def test_a_server_that_fails_is_declined_with_the_reason(loopback, served, ask, reply, reason):
    loopback.then(reply(loopback))
    with pytest.raises(Declined, match=reason):
        served().propose(ask(TIDY), within())


def test_a_server_that_is_gone_is_asked_once_and_then_left_alone(loopback, served, ask):
    loopback.then(loopback.sends(503, b""))
    back_end = served(breaker_failures=1)
    for _ in range(3):
        with pytest.raises(Declined):
            back_end.propose(ask(TIDY), within())
    assert len(loopback.heard) == 1
    assert back_end.document()["failures"]["CircuitOpen"] == 2


@pytest.mark.parametrize("steps", [(), (GO,)])
def test_a_question_of_the_model_is_asked_before_any_step(loopback, served, ask, steps):
    loopback.then(loopback.says(answer(*steps, question="Which\u202e cup?\n\x1b[2J")))
    with pytest.raises(Ambiguous) as asked:
        served().propose(ask(TIDY), within())
    assert asked.value.question == "Which cup? [2J"


def test_a_model_that_sees_no_way_is_believed(loopback, served, ask):
    loopback.then(loopback.says(answer(feasible=False, reasoning="it cannot fly")))
    with pytest.raises(CannotBeDone, match="server bench sees no way to do it: it cannot fly"):
        served().propose(ask(TIDY), within())


def test_no_plan_is_sent_back_that_nobody_waits_for(loopback, served, ask):
    recall = Event()

    def check(plan, request):
        recall.set()
        return checked(plan, request)

    loopback.then(loopback.says(answer(NOWHERE)))
    with pytest.raises(UnknownPlace):
        served(check).propose(ask(TIDY), within(20.0, recall))
    assert len(loopback.heard) == 1


def test_a_call_under_way_ends_soon_after_it_is_called_in(loopback, served, ask):
    loopback.then(loopback.raw(b"HTTP/1.1 200 OK\r\n", pause_s=2.0))
    recall = Event()
    clock = MonotonicClock()
    began_ns = clock.now_ns()
    with ThreadPoolExecutor(1) as pool:
        asked = pool.submit(served().propose, ask(TIDY), within(20.0, recall))
        while not loopback.heard:
            assert clock.now_ns() - began_ns < 10e9
        recall.set()
        with pytest.raises(Declined, match="nobody waits"):
            asked.result(timeout=1.5)


def test_the_picture_is_shown_to_a_model_that_sees_and_may(loopback, served, ask):
    image = np.full((48, 64, 3), 128, np.uint8)
    loopback.then(loopback.says(answer(GO)))
    assert served().uses == {Aid.MEMORY}
    served().propose(ask(TIDY, image=image), within())
    assert "image_url" not in json.dumps(loopback.heard[-1].body)
    back_end = served(vision=True)
    assert back_end.uses == {Aid.MEMORY, Aid.IMAGE}
    back_end.propose(ask(TIDY, image=image), within())
    body = json.dumps(loopback.heard[-1].body)
    assert "image_url" in body
    assert "The image shows what the robot sees now" in body
    remote = served(vision=True, location="remote", allow_text_off_robot=True)
    assert remote.uses == {Aid.MEMORY}


def test_of_a_server_that_is_not_trusted_words_alone_need_no_yes(loopback, served, ask):
    loopback.then(loopback.says(answer({"skill": "speak", "text": "hello"})))
    assert not served().propose(ask("greet us"), within()).is_read_back
