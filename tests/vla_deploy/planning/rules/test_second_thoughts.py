"""Who thinks again asks only for what comes after it, and for the same place as before."""

from collections.abc import Callable
from typing import TYPE_CHECKING

import pytest

from vla_deploy.planning.errors import PlanningError
from vla_deploy.planning.rules.second_thoughts import outright, thought_again

if TYPE_CHECKING:
    from conftest import Flat

GoesOn = Callable[[str], str]

TALKS = {
    "put the ball in the box >> put the book in the same place": "pick_up book; place box_1 in",
    "put the book in the box >> ah no, on the side table is better":
        "pick_up book; place side_table on",
    "pick up the book >> she changed her mind, put it back and take the ball":
        "pick_up book_1; place coffee_table on; pick_up ball",
    "look to the right >> now straight ahead again": "look_at ahead",
    "look to the right >> and now to the other side": "look_at left",
    "bring me the ball >> and what about the book?":
        "pick_up book; navigate_to 2.15 2.05 -1.571; speak Here is the book.",
    "put the red cup in the box >> with the blue one please do the same":
        "pick_up blue cup; place box in",
}  # fmt: skip


@pytest.mark.parametrize(("talk", "expected"), TALKS.items())
def test_what_is_said_after_all_is_done(goes_on: GoesOn, talk: str, expected: str) -> None:
    assert goes_on(talk) == expected


@pytest.mark.parametrize(
    "text",
    [
        "i've changed my mind",
        "never mind the cup, take the ball",
        "i don't need it",
        "put the ball in the box",
    ],
)
def test_what_asks_for_nothing_after_it_stays_as_it_is(text: str) -> None:
    assert thought_again(text) == text


def test_what_would_be_better_is_said_outright() -> None:
    assert outright("on the desk would be better") == "on the desk"
    assert outright("on the better desk") == "on the better desk"


@pytest.mark.parametrize(
    "talk",
    [
        "i don't need it any more",
        "now the book, same place",
        "pick up the book >> i've changed my mind",
    ],
)
def test_nothing_is_done_for_what_names_nothing_to_do(goes_on: GoesOn, talk: str) -> None:
    with pytest.raises(PlanningError):
        goes_on(talk)


def test_too_far_is_a_bit_back(flat: "Flat") -> None:
    before = flat.after("turn left forty degrees")
    plan = flat.plan("nah, too far. a bit back the other way.", conversation=before)
    assert plan.actions[0].parameters["angle_rad"] == pytest.approx(-0.1745, abs=1e-3)


def test_straight_ahead_without_a_look_before_is_no_look(flat: "Flat") -> None:
    with pytest.raises(PlanningError):
        flat.plan("straight ahead again", conversation=flat.after("pick up the ball"))
