"""Answer what the robot asks: at a terminal, or from a script by its exit code."""

import io
import os
import pty

import pytest

from vla_deploy.cli.say import Follower

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
