import pytest

from vla_deploy.planning.understanding.purposes import without_purpose


@pytest.mark.parametrize(
    ("said", "command"),
    [
        ("take the red book before the toddler does", "take the red book"),
        ("wait twenty seconds while i get past", "wait twenty seconds"),
        ("take the ball with your free hand", "take the ball"),
    ],
)
def test_what_a_command_is_for_is_left_out(said: str, command: str) -> None:
    assert without_purpose(said) == command


@pytest.mark.parametrize(
    "said",
    [
        "go to the kitchen while i am at work",  # not now
        "go to the kitchen so i can cook when dinner is ready",
        "wait and go forward while i sleep",
        "put the cup in your free hand",
    ],
)
def test_what_changes_a_command_stays(said: str) -> None:
    assert without_purpose(said) == said
