"""What a request asks of the robot reaches its rings, and nothing else does."""

import pytest


def test_a_command_travels_the_ring_of_the_command_line_with_the_pages_name(dashboard):
    given = dashboard.post("commands", body={"text": "wave"})
    (heard,) = dashboard.robot.hears("utterance")
    assert heard == {"command_id": given["command_id"], "source": "page", "text": "wave"}


def test_a_plan_travels_as_it_is_for_the_validator_to_judge(dashboard):
    plan = {"goal": "wave", "actions": [{"type": "wave"}]}
    dashboard.post("commands", body={"plan": plan})
    (heard,) = dashboard.robot.hears("utterance")
    assert heard["plan"] == plan
    assert "text" not in heard


@pytest.mark.parametrize(
    "body",
    [
        {},
        {"text": ""},
        {"text": 7},
        {"text": "x" * 1001},
        {"text": "wave", "plan": {}},
        {"text": "wave", "cancel": True},
        {"plan": "wave"},
        {"plan": {"goal": "x" * 70_000}},
        [],
        None,
    ],
    ids=str,
)
def test_what_is_no_command_is_refused_with_a_reason_and_never_said(dashboard, body):
    error = dashboard.post("commands", status=422, body=body)["error"]
    assert error["what"]
    assert error["try"]
    assert dashboard.robot.hears("utterance") == []


def test_a_refusal_is_told_with_its_reason(dashboard):
    command_id = dashboard.post("commands", body={"text": "fly"})["command_id"]
    dashboard.robot.tells(command_id, "rejected", reason="no skill is called fly")
    told = dashboard.get(f"commands/{command_id}")
    assert (told["state"], told["events"][-1]["reason"]) == ("rejected", "no skill is called fly")


def test_the_history_survives_a_reload_newest_first_and_bounded(dashboard):
    ids = [dashboard.post("commands", body={"text": text})["command_id"] for text in ("one", "two")]
    assert [one["command_id"] for one in dashboard.get("commands")] == ids[::-1]
    assert [one["text"] for one in dashboard.get("commands", limit=1)] == ["two"]
    dashboard.get("commands", status=422, limit=0)


def test_a_cancel_is_an_utterance_of_its_own(dashboard):
    command_id = dashboard.post("commands", body={"text": "wave"})["command_id"]
    cancel = dashboard.post(f"commands/{command_id}/cancel")["command_id"]
    heard = dashboard.robot.hears("utterance")[-1]
    assert heard == {"command_id": cancel, "source": "page", "cancel": True}
    assert dashboard.get(f"commands/{cancel}")["kind"] == "cancel"


@pytest.mark.parametrize(("act", "pause"), [("pause", True), ("resume", False)])
def test_a_pause_is_an_utterance_of_its_own(dashboard, act, pause):
    command_id = dashboard.post(f"commands/{act}")["command_id"]
    heard = dashboard.robot.hears("utterance")[-1]
    assert heard == {"command_id": command_id, "source": "page", "pause": pause}
    assert dashboard.get(f"commands/{command_id}")["kind"] == act


def test_what_has_ended_or_never_was_cannot_be_cancelled(dashboard):
    command_id = dashboard.post("commands", body={"text": "wave"})["command_id"]
    dashboard.robot.tells(command_id, "finished", success=True, error=None, actions=[])
    ended = dashboard.post(f"commands/{command_id}/cancel", status=409)
    assert "already ended: succeeded" in ended["error"]["what"]
    dashboard.post("commands/never/cancel", status=404)
    assert len(dashboard.robot.hears("utterance")) == 1


def test_an_answer_is_marked_as_one(dashboard):
    dashboard.post("commands/answer", body={"text": "the red one"})
    (heard,) = dashboard.robot.hears("utterance")
    assert (heard["text"], heard["answer"]) == ("the red one", True)
