"""What comes from outside controls no terminal, whatever command prints it."""

import io
import json
import sys

import pytest

from vla_deploy.cli import main as command_line
from vla_deploy.cli.terminal import (
    CLEAR_LINE,
    control,
    escaping_output,
)
from vla_deploy.client.escaping import escaped, escaped_document


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("red cup, 3 µm\n\tand a 杯子", "red cup, 3 µm\n\tand a 杯子"),
        ("\x1b]0;owned\x07\x1b[2J", "\\x1b]0;owned\\x07\\x1b[2J"),
        ("done\rfailed\x08\x7f", "done\\rfailed\\x08\\x7f"),
        ("\x9b31m", "\\x9b31m"),
        ("cup\u202epuc", "cup\\u202epuc"),
        ("one\u2028two", "one\\u2028two"),
        ("half \ud800", "half \\ud800"),
    ],
)
def test_what_controls_a_terminal_is_written_out(text, shown):
    assert escaped(text) == shown
    assert escaped_document({text: [text, 1]}) == {shown: [shown, 1]}


def test_every_command_escapes_what_it_prints_and_what_it_refuses(tmp_path, capsys):
    plan = tmp_path / "plan.json"
    plan.write_text(json.dumps({"actions": [{"skill": "\x1b[2J", "target": "\x07"}]}))
    assert command_line.main(["check", "--plan", str(plan)]) == 2
    assert command_line.main(["--runtime-base", f"{tmp_path}/\x1b[2J", "status"]) == 2
    captured = capsys.readouterr()
    assert "\\x1b[2J" in captured.err
    assert not {"\x1b", "\x07"} & set(captured.out + captured.err)


def test_what_the_command_line_itself_draws_reaches_the_terminal(monkeypatch):
    drawn = io.StringIO()
    monkeypatch.setattr(sys, "stderr", drawn)
    with escaping_output():
        control(CLEAR_LINE, sys.stderr)
        print("\x1b[2J", end="", file=sys.stderr)
    assert drawn.getvalue() == f"{CLEAR_LINE}\\x1b[2J"
    assert sys.stderr is drawn
