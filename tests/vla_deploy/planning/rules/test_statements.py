"""What asks for nothing lends its thing to what does; what is excluded stays excluded."""

from collections.abc import Callable

import pytest

from vla_deploy.planning.errors import NotUnderstood, PlanningError

Does = Callable[..., str]
BACK = "navigate_to 2.15 2.05 -1.571"


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("I can't find my phone anywhere, can you look for it?", "find_object phone"),
        ("I've lost my keys. Please find them", "find_object keys"),
        ("I think I left my ball in the bedroom, could you fetch it?",
         f"navigate_to bedroom; pick_up ball; {BACK}; speak Here is the ball."),
        ("my keys are in the bedroom, bring them",
         f"navigate_to bedroom; pick_up keys; {BACK}; speak Here is the keys."),
    ],
)  # fmt: skip
def test_a_statement_says_what_it_is(does: Does, text: str, expected: str) -> None:
    assert does(text).replace("my ", "") == expected


@pytest.mark.parametrize(
    "text",
    [
        "I can't find my phone",
        "I lost my job, can you find it?",
        "I left my heart in the kitchen, bring it to me",
        "I left my ball in narnia, fetch it",
    ],
)
def test_a_statement_alone_asks_for_nothing(does: Does, text: str) -> None:
    with pytest.raises(PlanningError):
        does(text)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("put the ball on the side table, not in the box", "place side_table on"),
        ("go to the bedroom, not to the kitchen", "navigate_to bedroom"),
        ("not the red cup, pick up the ball", "pick_up ball"),
        ("pick up the cups, not the red one", "pick_up cup_2"),
    ],
)
def test_where_not_is_left_out_beside_where(does: Does, text: str, expected: str) -> None:
    assert does(text) == expected


@pytest.mark.parametrize(
    "text",
    [
        "not the red cup, put them in the box",
        "put everything in the box, not on the table",
        "pick up the ball, not on the table",
        "not on the table",
    ],
)
def test_what_may_mean_what_is_excluded_is_refused(does: Does, text: str) -> None:
    with pytest.raises(NotUnderstood):
        does(text)


@pytest.mark.parametrize(
    "text",
    [
        "go to the, how do you say, the bedroom",
        "go to the, what was it, the bedroom",
        "go to the, let me think, bedroom",
    ],
)
def test_looking_for_a_word_says_nothing(does: Does, text: str) -> None:
    assert does(text) == "navigate_to bedroom"
