from dataclasses import replace
from typing import TYPE_CHECKING

from vla_deploy.planning.patterns.backend import pattern_plan
from vla_deploy.planning.understanding import (
    Conversation,
    ConversationTurn,
    Mention,
    MentionRole,
    TurnOutcome,
)
from vla_deploy.planning.understanding.conversation import MOST_TURNS, mentions_of
from vla_deploy.planning.understanding.grounding import ground_plan

if TYPE_CHECKING:
    from conftest import Home


def turn(number: int, *mentioned: str) -> ConversationTurn:
    return ConversationTurn(
        command_id=f"c{number}",
        said=f"command {number}",
        told_ns=number,
        mentioned=tuple(Mention(said=word, means=word) for word in mentioned),
    )


def test_only_the_last_turns_are_remembered() -> None:
    talk = Conversation()
    for number in range(MOST_TURNS + 3):
        talk = talk.after(turn(number))
    assert [one.command_id for one in talk.turns] == ["c3", "c4", "c5", "c6", "c7"]


def test_a_turn_told_again_takes_the_place_of_its_former_self() -> None:
    talk = Conversation().after(turn(1)).after(turn(2)).after(turn(1, "cup"))
    assert [one.command_id for one in talk.turns] == ["c2", "c1"]


def test_mentions_come_newest_first_and_last_word_first() -> None:
    talk = Conversation().after(turn(1, "ball")).after(turn(2, "cup", "box"))
    assert [one.means for one in talk.mentions()] == ["box", "cup", "ball"]


def test_the_end_of_a_turn_is_noted_and_of_a_forgotten_one_ignored() -> None:
    talk = Conversation().after(turn(1)).ended("c1", TurnOutcome.FAILED, "it slipped")
    assert (talk.turns[0].outcome, talk.turns[0].answer) == (TurnOutcome.FAILED, "it slipped")
    assert talk.ended("c9", TurnOutcome.SUCCEEDED) == talk


def test_a_plan_mentions_what_it_moves_and_where_to(home: "Home") -> None:
    request = home.ask("cup_1", "box_1", text="go to the kitchen and put the red cup in the box")
    plan = ground_plan(pattern_plan(request), request)
    assert [(one.means, one.thing_id, one.role) for one in mentions_of(plan, request.scene)] == [
        ("kitchen", "", MentionRole.PLACE),
        ("red cup", "cup_1", MentionRole.OBJECT),
        ("orange box", "box_1", MentionRole.DESTINATION),
    ]


def test_what_a_hand_had_is_mentioned_when_it_is_put_down(home: "Home") -> None:
    held = replace(home.things["cup_1"], rests=None, held_by="left")
    request = home.ask(held, "box_1", text="put it in the box")
    plan = ground_plan(pattern_plan(request), request)
    mentioned = {(one.thing_id, one.role) for one in mentions_of(plan, request.scene)}
    assert mentioned == {("cup_1", MentionRole.OBJECT), ("box_1", MentionRole.DESTINATION)}
