import pytest

from vla_deploy.planning.rules.breaths import without_breaths


@pytest.mark.parametrize(
    ("heard", "said"),
    [
        ("put the red, can in the, box", "put the red can in the box"),
        ("bring, me the, cup", "bring me the cup"),
        ("the red cup, no, wait, the blue one", "the red cup, no wait, the blue one"),
    ],
)
def test_a_breath_is_no_comma(heard: str, said: str) -> None:
    assert without_breaths(heard) == said


@pytest.mark.parametrize(
    "text",
    [
        "go to the kitchen, then bring me the cup",
        "the red, blue and green cups",
        "turn left, then right, please",
        "take the cup, the red one",
    ],
)
def test_a_comma_where_a_thought_ends_stays(text: str) -> None:
    assert without_breaths(text) == text
