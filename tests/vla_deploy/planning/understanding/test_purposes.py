import pytest

from vla_deploy.planning.understanding.purposes import without_purpose


@pytest.mark.parametrize(
    ("said", "command"),
    [
        ("take the red book before the toddler does", "take the red book"),
        ("lift the remote, before somebody sits on it!", "lift the remote"),
        ("fetch it here so i don't have to get up", "fetch it here"),
        ("wait twenty seconds while i get past", "wait twenty seconds"),
        ("put it in the box for safe keeping", "put it in the box"),
        ("bring me the keys, chop chop", "bring me the keys"),
        ("take the ball with your free hand", "take the ball"),
    ],
)
def test_what_a_command_is_for_is_left_out(said: str, command: str) -> None:
    assert without_purpose(said) == command


@pytest.mark.parametrize(
    "said",
    [
        "go to the kitchen while i am at work",  # not now
        "go to the kitchen before the bedroom",
        "bring me the cup before dinner",
        "take the ball with your left hand",
        "chop chop",
        "go to the kitchen so i can cook when dinner is ready",
        "bring me the ball so that i can throw it unless it is wet",
        "go to the bedroom so i don't see you until i call",
        "wait and go forward while i sleep",
        "put the cup in the box so it won't roll off then go to the kitchen",
        "take the red cup before it falls and put it in the box",
        "put the cup in your free hand",
    ],
)
def test_what_changes_a_command_stays(said: str) -> None:
    assert without_purpose(said) == said
