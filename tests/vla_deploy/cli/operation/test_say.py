"""`vla-deploy say`: answers to the robot's questions, and a line for each event."""

import io
import os
import pty

import pytest

from vla_deploy.cli.operation.say import Follower, line_of
from vla_deploy.client.action_words import action_words

ASKED = {"question": "Which cup?", "choices": [], "answer_within_s": 20.0, "plan": None}


@pytest.fixture
def terminal():
    """Return both ends of a terminal."""
    keyboard, screen = pty.openpty()
    with os.fdopen(screen, "r") as opened, os.fdopen(keyboard, "wb", buffering=0) as typing:
        yield opened, typing


def test_what_is_typed_after_a_question_is_its_answer(session, robot, terminal, capsys):
    opened, typing = terminal
    typing.write(b"the red one\n")
    heard = []

    def play() -> None:
        heard.extend(robot.heard())
        match len(heard):
            case 1 if heard[-1].get("text") == "take the cup":
                robot.tell(heard[0]["command_id"], "asked", **ASKED)
            case 2:
                robot.tell(heard[0]["command_id"], "finished", success=True, error=None, actions=[])

    robot.clock.after_wait = play
    last = Follower(session, quiet=False, terminal=opened).follow({"text": "take the cup"})
    assert last["event"] == "finished"
    assert (heard[1]["text"], heard[1]["answer"]) == ("the red one", True)
    assert "robot asks: Which cup?" in capsys.readouterr().out


@pytest.mark.parametrize("quiet", [True, False])
def test_without_a_terminal_the_question_is_the_outcome(session, robot, quiet):
    robot.clock.after_wait = lambda: robot.tell(robot.heard()[-1]["command_id"], "asked", **ASKED)
    last = Follower(session, quiet, terminal=io.StringIO()).follow({"text": "take the cup"})
    assert (last["event"], last["question"]) == ("asked", "Which cup?")


PICK = {"skill": "pick_up", "parameters": {"object": "red cup"}}


def action(status: str, error: str | None = None) -> dict:
    return PICK | {"event": "action", "status": status, "execution_time_s": 3.25, "error": error}


@pytest.mark.parametrize(
    ("event", "line"),
    [
        ({"event": "accepted"}, None),
        (
            {"event": "plan", "plan": {"actions": [PICK, PICK]}},
            "plan: pick up red cup; pick up red cup",
        ),
        (
            {"event": "plan", "plan": {"actions": [PICK]}, "rung": "server bench"},
            "plan: pick up red cup  (by server bench)",
        ),
        (
            {"event": "plan", "plan": {"actions": [PICK], "notes": ["a1: force 3: not used"]}},
            "plan: pick up red cup\n  note: a1: force 3: not used",
        ),
        (
            {"event": "planning", "rungs": ["parser", "server bench"]},
            "asking parser, server bench ...",
        ),
        ({"event": "queued", "place": 2}, "waits for 2 before it"),
        ({"event": "asked", "question": "Which cup?"}, "robot asks: Which cup?"),
        (action("active"), "… pick up red cup"),
        (
            action("active", "trying again after: slipped"),
            "… pick up red cup  trying again after: slipped",
        ),
        (action("succeeded"), "✓ pick up red cup  (3.2 s)"),
        (action("aborted", "no such cup"), "✗ pick up red cup  (3.2 s)  no such cup"),
        (action("cancelled", "on request"), "- pick up red cup  (3.2 s)  on request"),
        ({"event": "said", "text": "here you are"}, "robot says: here you are"),
        ({"event": "rejected", "reason": "disarmed"}, "refused: disarmed"),
        ({"event": "finished", "success": True, "error": None}, "done"),
        ({"event": "finished", "success": False, "error": "no way"}, "failed: no way"),
    ],
)
def test_every_event_is_told_briefly_or_not_at_all(event, line):
    assert line_of(event) == line


def test_numbers_of_an_action_are_told_short():
    assert action_words("turn", {"angle_rad": 1.5707963}) == "turn 1.5708"


def test_a_relation_goes_before_what_it_relates_to():
    placed = {"object": "cup", "destination": "box", "relation": "in"}
    assert action_words("place", placed) == "place cup in box"
