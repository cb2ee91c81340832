"""What an agent may ask of the planner, and what ends with its lease."""

import json
from collections.abc import Callable
from pathlib import Path

import pytest

from vla_deploy.client.access.audit_log import AuditFile, AuditLog
from vla_deploy.client.agent_lease import LeaseKeeper
from vla_deploy.plans.agent_rules import LEASE_ENDED

AGENT = "agent:tester"
GO = "go to the kitchen"


@pytest.fixture
def lease(desk) -> LeaseKeeper:
    return LeaseKeeper(desk.space, desk.clock)


def asks(desk, **utterance: object) -> list[tuple[str, str]]:
    """Let the agent give an utterance; return each event of the answer with its reason."""
    events = desk.answers_to(source=AGENT, **utterance)
    return [(one["event"], str(one.get("reason") or "")) for one in events]


def test_an_agent_commands_nothing_before_a_person_has_leased_the_robot(desk, lease):
    ((event, reason),) = asks(desk, text=GO)
    assert event == "rejected"
    assert "vla-deploy agent lease" in reason
    lease.grant("cli:anna", 10)
    assert asks(desk, text=GO)[-1][0] == "plan"
    lease.revoke("cli:anna")
    assert "rule lease_revoked" in asks(desk, text="turn left")[-1][1]


@pytest.mark.parametrize(
    ("utterance", "rule"),
    [
        ({"text": "yes", "answer": True}, "person_answers"),
        ({"mission": {"objectives": [{"words": GO}]}}, "one_command"),
        ({"mission_act": {"cancel": "m1"}}, "one_command"),
        ({"text": f"{GO}; turn left"}, "one_command"),
        ({"text": f"in two hours, {GO}"}, "one_command"),
        ({"pause": False}, "person_resumes"),
        ({"text": "go on"}, "person_resumes"),
        ({"text": f"{GO} when I say so"}, "no_held_plans"),
        ({"text": "never go to the kitchen again"}, "person_forbids"),
    ],
)
def test_a_lease_does_not_permit(desk, lease, utterance, rule):
    lease.grant("cli:anna", 10)
    event, reason = asks(desk, **utterance)[-1]
    assert (event, f"(rule {rule})" in reason) == ("rejected", True), reason
    assert desk.plans() == []


@pytest.mark.parametrize("stop", [{"cancel": True}, {"text": "stop"}, {"text": "Stop!"}])
@pytest.mark.parametrize("is_asked", [False, True])
def test_a_stop_needs_no_lease(desk, stop, is_asked):
    if is_asked:
        desk.sees("red cup_1", "blue cup_2")
        assert desk.answers_to("pick up the cup")[-1]["event"] == "asked"
    desk.give(source=AGENT, **stop)
    desk.answers()
    assert {"command_id": f"c{1 + is_asked}", "cancel": True} in desk.plans()


@pytest.mark.parametrize("words", ["yes", "the red one", "no, the blue one", "go", GO, "no"])
@pytest.mark.parametrize("asked_by", ["test", AGENT])
def test_a_question_is_answered_by_a_person_alone(desk, lease, words, asked_by):
    lease.grant("cli:anna", 10)
    desk.sees("red cup_1", "blue cup_2")
    assert desk.answers_to("pick up the cup", source=asked_by)[-1]["event"] == "asked"
    event, reason = asks(desk, text=words)[-1]
    assert (event, "(rule person_answers)" in reason) == ("rejected", True)
    assert desk.plans() == []
    assert desk.answers_to("the red one")[-1]["event"] == "plan"


def test_a_plan_that_is_read_back_is_confirmed_by_a_person_alone(desk, lease):
    lease.grant("cli:anna", 10)
    risky = {
        "actions": [{"skill": "navigate_to", "parameters": {"place": "kitchen"}}],
        "safety_concerns": ["the floor is wet"],
    }
    assert asks(desk, plan=risky)[-1][0] == "asked"
    for attempt in ({"text": "yes"}, {"text": "yes", "answer": True}, {"plan": risky}):
        assert "(rule person_answers)" in asks(desk, **attempt)[-1][1]
    assert desk.plans() == []
    assert desk.answers_to("yes")[-1]["event"] == "plan"


@pytest.mark.parametrize("ends", ["expires", "revoked"])
def test_what_an_agent_asked_for_ends_with_its_lease(desk, lease, ends):
    lease.grant("cli:anna", 1)
    desk.plans_for(GO, source=AGENT)
    if ends == "expires":
        desk.clock.pass_s(60.0)
    else:
        lease.revoke("cli:anna")
    desk.answers()
    assert [(one["of"], one["cancel"]) for one in desk.plans()] == [("c1", True)]
    desk.answers()
    assert desk.plans() == []


def test_a_question_of_an_agents_command_goes_with_the_lease(desk, lease):
    lease.grant("cli:anna", 1)
    desk.sees("red cup_1", "blue cup_2")
    asks(desk, text="pick up the cup")
    lease.revoke("cli:anna")
    assert [(one["event"], one["reason"]) for one in desk.answers()] == [("rejected", LEASE_ENDED)]
    assert desk.answers_to("yes")[-1]["event"] == "rejected"


def test_the_end_of_a_lease_leaves_a_persons_command_alone(desk, lease):
    lease.grant("cli:anna", 1)
    desk.plans_for(GO)
    lease.revoke("cli:anna")
    desk.answers()
    assert desk.plans() == []


def test_a_planner_that_is_started_again_still_ends_an_agents_command(desk, lease):
    lease.grant("cli:anna", 1)
    desk.plans_for(GO, source=AGENT)
    desk.carried_out = ["c1"]
    desk.executor_is("executing")
    desk.start()
    lease.revoke("cli:anna")
    desk.answers()
    assert [one.get("of") for one in desk.plans()] == ["c1"]


def test_refusals_are_audited_with_sender_and_rule(open_desk: Callable, tmp_path: Path):
    file = AuditFile(tmp_path / "audit.jsonl")
    desk = open_desk()
    desk.audit = AuditLog(file, desk.clock)
    desk.start()
    asks(desk, text=GO + " \x1b[2J" + "x" * 900)
    (entry,) = file.newest(9)
    assert (entry["user"], entry["way"]) == (AGENT, "planner")
    assert (entry["outcome"], entry["code"]) == ("refused", "not_leased")
    assert len(json.dumps(entry)) < 900
