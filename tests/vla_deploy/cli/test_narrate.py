import pytest

from vla_deploy.cli.narrate import line_of
from vla_deploy.client.action_words import action_words

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
def test_every_event_is_told_in_one_line_or_not_at_all(event, line):
    assert line_of(event) == line


def test_numbers_of_an_action_are_told_short():
    assert action_words("turn", {"angle_rad": 1.5707963}) == "turn 1.5708"


def test_a_relation_goes_before_what_it_relates_to():
    placed = {"object": "cup", "destination": "box", "relation": "in"}
    assert action_words("place", placed) == "place cup in box"
