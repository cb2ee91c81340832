from dataclasses import replace
from typing import TYPE_CHECKING, Any

import pytest

from vla_deploy.planning.errors import Ambiguous, NotAble
from vla_deploy.planning.interfaces import PlanRequest
from vla_deploy.planning.understanding import Conversation, ConversationTurn, Mention
from vla_deploy.planning.understanding.fitting import ThingUse
from vla_deploy.planning.understanding.resolver import Resolver
from vla_deploy.plans.errors import UnknownObject
from vla_deploy.world import Thing
from vla_deploy.world.thing import Rest

if TYPE_CHECKING:
    from conftest import Home


ALL = ("cup_1", "cup_2", "ball_1", "box_1")
CUPS = ("cup_1", "cup_2", "cup_4")


def name(request: PlanRequest, text: str, use: ThingUse = ThingUse.TAKE) -> str:
    return Resolver(request).thing(text, use).name


@pytest.mark.parametrize(
    ("things", "spoken", "text", "use", "meant"),
    [
        (ALL, (), "a cup", ThingUse.TAKE, "cup_1"),
        (ALL, (), "the cup on the left", ThingUse.TAKE, "cup_2"),
        (ALL, (), "the nearest cup", ThingUse.TAKE, "cup_1"),
        (ALL, (), "the red one", ThingUse.TAKE, "cup_1"),
        (ALL, (), "the bottle", ThingUse.TAKE, "bottle"),
        (ALL, (), "the red cup on the table", ThingUse.TAKE, "cup_1"),
        (("cup_1", "box_1"), (), "it", ThingUse.TAKE, "cup_1"),
        (ALL, ("ball_1", "cup_1"), "that one", ThingUse.TAKE, "cup_1"),
        (ALL, ("ball_1", "cup_1"), "the other cup", ThingUse.TAKE, "cup_2"),
        (ALL, ("cup_1",), "the blue one", ThingUse.TAKE, "cup_2"),
        (ALL, ("cup_2", "ball_1"), "the cup", ThingUse.TAKE, "cup_2"),
        (ALL, ("cup_1", "box_1"), "it", ThingUse.TAKE, "cup_1"),
        (ALL, ("box_1",), "it", ThingUse.ONTO, "box_1"),
        (("cup_1 in left", "ball_1"), ("ball_1",), "it", ThingUse.PUT, "cup_1"),
        (("cup_1 in right",), (), "what is in your right hand", ThingUse.PUT, "cup_1"),
        (("cup_1 in right", "cup_2"), (), "the cup that you hold", ThingUse.PUT, "cup_1"),
        # What is held is not what shall be taken, though the word alone finds it as well.
        (("cup_1 in left", "cup_2"), (), "the cup", ThingUse.TAKE, "cup_2"),
        (("cup_1 in left", "cup_2"), (), "the blue cup", ThingUse.TAKE, "blue cup"),
    ],
)  # fmt: skip
def test_words_that_single_a_thing_out_resolve(
    home: "Home",
    things: tuple[str, ...],
    spoken: tuple[str, ...],
    text: str,
    use: ThingUse,
    meant: str,
) -> None:
    assert name(home.ask(*things, conversation=home.spoke_of(*spoken)), text, use) == meant


@pytest.mark.parametrize(
    ("things", "spoken", "text", "use", "meant"),
    [
        (ALL, ("cup_1", "ball_1"), "them", ThingUse.TAKE, [("cup_1", ""), ("ball_1", "")]),
        (ALL, (), "all the cups", ThingUse.TAKE, [("cup_1", ""), ("cup_2", "")]),
        (ALL, (), "both cups", ThingUse.TAKE, [("cup_1", ""), ("cup_2", "")]),
        (ALL, (), "the two cups", ThingUse.TAKE, [("cup_1", ""), ("cup_2", "")]),
        (ALL, (), "two cups", ThingUse.TAKE, [("cup_1", ""), ("cup_2", "")]),
        *(
            (("cup_1 in right", "ball_1 in left", "cup_2"), (), held, ThingUse.PUT,
             [("cup_1", "right"), ("ball_1", "left")])
            for held in ("them", "both", "what you are holding")
        ),
    ],
)  # fmt: skip
def test_words_that_mean_several_find_all_of_them(
    home: "Home",
    things: tuple[str, ...],
    spoken: tuple[str, ...],
    text: str,
    use: ThingUse,
    meant: list[tuple[str, str]],
) -> None:
    request = home.ask(*things, conversation=home.spoke_of(*spoken))
    assert [(one.name, one.hand or "") for one in Resolver(request).things(text, use)] == meant


@pytest.mark.parametrize(
    ("things", "text", "refusal", "says"),
    [
        ((), "it", UnknownObject, 'I do not know the object "it"'),
        (("cup_1 in right",), "what is in your left hand", NotAble, "my left hand holds nothing"),
        ((), "what you are holding", NotAble, "^I hold nothing$"),
        (CUPS, "everything but that", NotAble, 'I see nothing that is "everything but"'),
        (CUPS, "both cups", NotAble, 'I see 3 that could be "both cups"'),
        (CUPS, "the two cups", NotAble, 'I see 3 that could be "two cups"'),
        (CUPS, "two cups", NotAble, 'I see 3 that could be "two cups"'),
    ],
)  # fmt: skip
def test_words_that_mean_nothing_are_refused(
    home: "Home",
    things: tuple[str, ...],
    text: str,
    refusal: type[Exception],
    says: str,
) -> None:
    with pytest.raises(refusal, match=says):
        Resolver(home.ask(*things)).things(text, ThingUse.PUT)


@pytest.mark.parametrize(
    ("changes", "third", "question"),
    [
        ({}, (), "Which cup, the red one or the blue one?"),
        ({}, ("cup_4",), "Which cup, the red one, the blue one or the green one?"),
        ({"colour": "red"}, (), "Which cup, the one on the right or the one on the left?"),
        (
            {"colour": "red", "rests": Rest("on", "side_table")},
            (),
            "Which cup, the one on the coffee table or the one on the side table?",
        ),
    ],
)
def test_what_nothing_singles_out_is_asked_and_an_answer_settles_it(
    home: "Home", changes: dict[str, Any], third: tuple[str, ...], question: str
) -> None:
    things = ("cup_1", replace(home.things["cup_2"], **changes), *third)
    with pytest.raises(Ambiguous) as asked:
        name(home.ask(*things), "the cup")
    assert asked.value.question == question
    assert asked.value.expression == "cup"
    assert [one.name for one in asked.value.candidates][:2] == ["cup_1", "cup_2"]
    talk = Conversation(choices={"cup": "cup_2"})
    assert name(home.ask(*things, conversation=talk), "the cup") == "cup_2"


def test_which_hand_is_meant_is_asked(home: "Home") -> None:
    held = [
        replace(home.things["cup_1"], held_by="right", rests=None),
        replace(home.things["cup_4"], held_by="left", rests=None, colour="red"),
    ]
    for text in ("it", "the thing in your hand"):
        with pytest.raises(Ambiguous) as asked:
            name(home.ask(*held, "ball_1"), text, ThingUse.PUT)
        assert "the one in my right hand" in asked.value.question
        assert ["right" in one.features for one in asked.value.candidates].count(True) == 1


def test_an_unseen_thing_on_furniture_is_looked_for_there(home: "Home") -> None:
    meant = Resolver(home.ask()).thing("the bottle on the kitchen table", ThingUse.TAKE)
    assert (meant.name, meant.look_at) == ("bottle", "kitchen_table")


def test_every_decision_is_logged_with_its_reason(home: "Home") -> None:
    resolver = Resolver(home.ask("cup_1", "cup_2", "ball_1"))
    resolver.thing("the left cup", ThingUse.TAKE)
    resolver.thing("the bottle", ThingUse.ONTO)
    assert resolver.reasons == [
        '"left cup" is cup_2 (blue cup) (the only one that fits)',
        '"bottle" is bottle (not seen yet)',
    ]


# --- what only the things around tell ---------------------------------------------------------


def _thing(name: str, colour: str, x_m: float, y_m: float = 1.5, **changes: Any) -> Thing:
    fields: dict[str, Any] = {
        "thing_id": name,
        "kind": name.partition("_")[0],
        "colour": colour,
        "position_m": (x_m, y_m, 0.525),
        "size_m": (0.06, 0.06, 0.15),
        "rests": Rest("on", "coffee_table"),
    }
    return Thing(**(fields | changes))


# The robot looks down the y axis: what has the larger x stands farther to the left.
BOTTLES = (
    _thing("bottle_1", "green", 1.7),
    _thing("bottle_2", "white", 2.1, 1.2, size_m=(0.08, 0.08, 0.25)),
    _thing("bottle_3", "green", 2.6),
)
ELSEWHERE = _thing("bottle_4", "pink", -1.8, 4.5, rests=Rest("on", "kitchen_table"))
BALL = _thing("ball_1", "pink", 2.4, size_m=(0.06, 0.06, 0.06))
CAN = _thing("can_1", "pink", 2.0, 1.6, size_m=(0.065, 0.065, 0.12))


@pytest.mark.parametrize(
    ("text", "meant"),
    [
        ("the left bottle on the coffee table", ["bottle_3"]),
        ("the middle bottle on the table in the kitchen", None),
        ("the farthest bottle", ["bottle_4"]),
        ("the biggest bottle", ["bottle_2"]),
        ("the smaller can", ["can_1"]),
        ("all bottles except the white one", ["bottle_1", "bottle_3", "bottle_4"]),
        ("all green bottles but the nearest", ["bottle_3"]),
        ("any bottle but the green ones or the pink one", ["bottle_2"]),
        ("that ball on the table there", ["ball_1"]),
        ("the cup in the kitchen", ["cup_9"]),
    ],
)
def test_it_is_told_from_the_things_around(
    home: "Home", text: str, meant: list[str] | None
) -> None:
    cup = replace(home.things["cup_1"], thing_id="cup_9", rests=Rest("on", "kitchen_table"))
    resolver = Resolver(home.ask(*BOTTLES, ELSEWHERE, BALL, CAN, "box_1", "cup_2", cup))
    if meant is None:
        with pytest.raises(UnknownObject):
            resolver.things(text, ThingUse.TAKE)
    else:
        assert (
            sorted(one.thing.thing_id for one in resolver.things(text, ThingUse.TAKE) if one.thing)
            == meant
        )


@pytest.mark.parametrize(
    ("text", "question"),
    [
        ("the left bottle", "Which bottle, "),  # one stands elsewhere
        ("the middle green bottle", "Which bottle, "),
        ("the bottle that isn't white", "Which bottle, "),
        ("the bigger cup", "Which cup, "),
    ],
)
def test_what_still_means_several_is_asked(home: "Home", text: str, question: str) -> None:
    with pytest.raises(Ambiguous) as asked:
        name(home.ask(*BOTTLES, ELSEWHERE, CAN, "cup_1", "cup_2"), text)
    assert asked.value.question.startswith(question)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("the can that isn't pink", 'nothing that is "can is not pink", only the pink can'),
        ("the left book", 'I see nothing that is "left book"$'),
        ("the biggest book", 'I see nothing that is "biggest book"$'),
        ("any cup but the blue one", 'nothing that is "any cup but blue one"$'),
        ("the other can", 'nothing that is "other can", only the pink can'),
        ("all books but it", 'nothing that is "all books but it"$'),
    ],
)
def test_what_is_not_there_is_said_to_be_not(home: "Home", text: str, says: str) -> None:
    talk = Conversation().after(
        ConversationTurn(
            said="before",
            mentioned=(Mention(said="can", means="can", thing_id="can_1", kind="can"),),
        )
    )
    with pytest.raises(NotAble, match=says):
        name(home.ask(*BOTTLES, CAN, conversation=talk), text)


def test_the_big_one_is_of_the_kind_spoken_of_that_can_be_taken(home: "Home") -> None:
    large = replace(BALL, thing_id="ball_2", colour="red", size_m=(0.09, 0.09, 0.09))
    resolver = Resolver(home.ask(BALL, large, *BOTTLES, "box_1"))
    resolver.thing("the small ball", ThingUse.PUT)
    resolver.thing("the box", ThingUse.ONTO)
    assert resolver.thing("the bigger one", ThingUse.PUT).name == "ball_2"
