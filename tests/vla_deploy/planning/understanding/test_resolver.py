from dataclasses import replace
from typing import TYPE_CHECKING, Any

import pytest

from vla_deploy.planning.errors import Ambiguous, NotAble, UnknownObject
from vla_deploy.planning.interfaces import Request
from vla_deploy.planning.understanding import Conversation
from vla_deploy.planning.understanding.fitting import Use
from vla_deploy.planning.understanding.resolver import Resolver
from vla_deploy.world.thing import Rest

if TYPE_CHECKING:
    from conftest import Home


def name(request: Request, text: str, use: Use = Use.TAKE) -> str:
    return Resolver(request).thing(text, use).name


@pytest.mark.parametrize(
    ("text", "meant"),
    [
        ("a cup", "cup_1"),
        ("the cup on the left", "cup_2"),
        ("the nearest cup", "cup_1"),
        ("the red one", "cup_1"),
        ("the bottle", "bottle"),
        ("the read cup", "red cup"),
        ("the red cup on the table", "cup_1"),
    ],
)
def test_words_that_single_a_thing_out_resolve(home: "Home", text: str, meant: str) -> None:
    near = replace(home.things["ball_1"], position_m=(2.15, 1.5, 0.475))
    assert name(home.ask("cup_1", "cup_2", near, "box_1"), text) == meant


@pytest.mark.parametrize(
    ("changes", "question"),
    [
        ({}, "Which cup, the red one or the blue one?"),
        ({"colour": "red"}, "Which cup, the one on the right or the one on the left?"),
        (
            {"colour": "red", "rests": Rest("on", "side_table")},
            "Which cup, the one on the coffee table or the one on the side table?",
        ),
    ],
)
def test_what_nothing_singles_out_is_asked(
    home: "Home", changes: dict[str, Any], question: str
) -> None:
    other = replace(home.things["cup_2"], **changes)
    with pytest.raises(Ambiguous) as asked:
        name(home.ask("cup_1", other), "the cup")
    assert asked.value.question == question
    assert asked.value.expression == "cup"
    assert [one.name for one in asked.value.candidates] == ["cup_1", "cup_2"]


def test_three_are_told_apart_too(home: "Home") -> None:
    with pytest.raises(Ambiguous, match="the red one, the blue one or the green one"):
        name(home.ask("cup_1", "cup_2", "cup_4"), "the cup")


def test_the_answer_settles_it(home: "Home") -> None:
    talk = Conversation(choices={"cup": "cup_2"})
    assert name(home.ask("cup_1", "cup_2", conversation=talk), "the cup") == "cup_2"


def test_a_word_that_only_sounds_like_a_known_one_is_asked(home: "Home") -> None:
    with pytest.raises(Ambiguous) as asked:
        name(home.ask("cup_1"), "the red cap")
    assert asked.value.question == "Did you mean the cup?"
    talk = Conversation(choices={"red cap": asked.value.candidates[0].name})
    assert name(home.ask("cup_1", conversation=talk), "the red cap") == "red cup"


@pytest.mark.parametrize(
    ("text", "use", "spoken", "meant"),
    [
        ("that one", Use.TAKE, ("ball_1", "cup_1"), "cup_1"),
        ("the other cup", Use.TAKE, ("ball_1", "cup_1"), "cup_2"),
        ("the blue one", Use.TAKE, ("cup_1",), "cup_2"),
        ("the cup", Use.TAKE, ("cup_2", "ball_1"), "cup_2"),
        ("it", Use.TAKE, ("cup_1", "box_1"), "cup_1"),
        ("it", Use.ONTO, ("box_1",), "box_1"),
    ],
)
def test_what_was_spoken_of_is_meant(
    home: "Home", text: str, use: Use, spoken: tuple[str, ...], meant: str
) -> None:
    request = home.ask("cup_1", "cup_2", "ball_1", "box_1", conversation=home.spoke_of(*spoken))
    assert name(request, text, use) == meant


def test_them_are_all_that_the_last_turn_was_about(home: "Home") -> None:
    resolver = Resolver(
        home.ask("cup_1", "cup_2", "ball_1", "box_1", conversation=home.spoke_of("cup_1", "ball_1"))
    )
    assert [one.name for one in resolver.things("them", Use.TAKE)] == ["cup_1", "ball_1"]


def test_all_cups_are_all_cups(home: "Home") -> None:
    resolver = Resolver(home.ask("cup_1", "cup_2", "ball_1"))
    assert [one.name for one in resolver.things("all the cups", Use.TAKE)] == ["cup_1", "cup_2"]


def test_it_is_what_the_hand_holds_before_what_was_spoken_of(home: "Home") -> None:
    held = replace(home.things["cup_1"], held_by="left")
    assert (
        name(home.ask(held, "ball_1", conversation=home.spoke_of("ball_1")), "it", Use.PUT)
        == "cup_1"
    )


def test_a_hand_that_holds_nothing_says_so_and_what_the_other_one_holds(home: "Home") -> None:
    cup = replace(home.things["cup_1"], held_by="right")
    request = home.ask(cup)
    assert name(request, "what is in your right hand", Use.PUT) == "cup_1"
    with pytest.raises(NotAble, match="my left hand holds nothing; the right one holds the red"):
        name(request, "what is in your left hand", Use.PUT)
    with pytest.raises(NotAble, match=r"^I hold nothing$"):
        name(home.ask(), "what you are holding", Use.PUT)


def test_what_is_held_is_not_what_shall_be_taken(home: "Home") -> None:
    request = home.ask(replace(home.things["cup_1"], held_by="left"), "cup_2")
    assert name(request, "the cup") == "cup_2", "the word alone would find the held one as well"
    assert name(request, "the blue cup") == "blue cup"


def test_the_only_thing_in_sight_is_it(home: "Home") -> None:
    assert name(home.ask("cup_1", "box_1"), "it") == "cup_1"


def test_a_pronoun_for_nothing_is_refused(home: "Home") -> None:
    with pytest.raises(UnknownObject):
        name(home.ask(), "it")


def test_an_unseen_thing_on_furniture_is_looked_for_there(home: "Home") -> None:
    meant = Resolver(home.ask()).thing("the bottle on the kitchen table", Use.TAKE)
    assert (meant.name, meant.look_at) == ("bottle", "kitchen_table")


def test_every_decision_is_logged_with_its_reason(home: "Home") -> None:
    resolver = Resolver(home.ask("cup_1", "cup_2", "ball_1"))
    resolver.thing("the left cup", Use.TAKE)
    resolver.thing("the botle", Use.ONTO)
    assert resolver.reasons == [
        '"left cup" is cup_2 (blue cup) (the only one that fits)',
        '"botle" is bottle (not seen yet)',
    ]


@pytest.mark.parametrize(
    ("text", "meant"),
    [
        ("two cups", ["cup_1", "cup_2"]),
        ("a couple of cups", ["cup_1", "cup_2"]),
        ("three cups", ["cup_1", "cup_2", "cup_3"]),
        ("all three cups", ["cup_1", "cup_2", "cup_3"]),
    ],
)
def test_so_many_as_are_counted_are_meant(home: "Home", text: str, meant: list[str]) -> None:
    far = replace(home.things["cup_2"], thing_id="cup_3", position_m=(9.0, 9.0, 0.5))
    found = Resolver(home.ask("cup_1", "cup_2", far)).things(text, Use.TAKE)
    assert sorted(one.name for one in found) == meant


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("both cups", "I see 3 cups, and cannot tell which 2 you mean"),
        ("the two cups", "I see 3 cups, and cannot tell which 2 you mean"),
        ("four cups", "I see only 3 cups"),
        ("two balls", "I see only 1 ball"),
    ],
)
def test_what_is_counted_otherwise_is_told(home: "Home", text: str, reason: str) -> None:
    far = replace(home.things["cup_2"], thing_id="cup_3", position_m=(9.0, 9.0, 0.5))
    with pytest.raises(NotAble, match=reason):
        Resolver(home.ask("cup_1", "cup_2", far, "ball_1")).things(text, Use.TAKE)
