"""Words for order bring the parts of a command into the order of doing; conditions stay refused."""

from collections.abc import Callable

import pytest

from vla_deploy.planning.errors import NotUnderstood

Does = Callable[..., str]
BOOK_THEN_KITCHEN = "place box in; navigate_to kitchen"


@pytest.mark.parametrize(
    "text",
    [
        "before you drive to the kitchen, put the book in the box",
        "before going to the kitchen put the book in the box",
        "as soon as you have stowed the book in the box, go to the kitchen",
        "first put the book in the box, then go to the kitchen",
        "put the book in the box. When you're done, go to the kitchen",
    ],
)
def test_what_comes_first_is_done_first(does: Does, text: str) -> None:
    assert does(text) == BOOK_THEN_KITCHEN


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("go to the bedroom. Once you are there, turn right",
         "navigate_to bedroom; turn -1.5707963267948966"),
        ("when you are in the bedroom, turn right",
         "navigate_to bedroom; turn -1.5707963267948966"),
        ("after you have been to the bedroom and the kitchen, go to the entrance",
         "navigate_to bedroom; navigate_to kitchen; navigate_to entrance"),
        ("before you put it in the box, pick up the ball", "pick_up ball; place box in"),
    ],
)  # fmt: skip
def test_being_somewhere_is_going_there(does: Does, text: str, expected: str) -> None:
    assert does(text) == expected


@pytest.mark.parametrize(
    "text",
    [
        "once the ball is in the box, go to the kitchen",
        "wait before you go to the kitchen",
        "go to the kitchen, but first stop",
        "before you go to narnia put the ball in the box",
    ],
)
def test_conditions_and_what_holds_the_robot_up_are_no_order(does: Does, text: str) -> None:
    with pytest.raises(NotUnderstood):
        does(text)
