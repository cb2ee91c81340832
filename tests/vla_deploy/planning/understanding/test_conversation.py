from vla_deploy.planning.understanding import Conversation, Mention, Outcome, Turn
from vla_deploy.planning.understanding.conversation import MOST_TURNS


def turn(number: int, *mentioned: str) -> Turn:
    return Turn(
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
    talk = Conversation().after(turn(1)).ended("c1", Outcome.FAILED, "it slipped")
    assert (talk.turns[0].outcome, talk.turns[0].answer) == (Outcome.FAILED, "it slipped")
    assert talk.ended("c9", Outcome.SUCCEEDED) == talk
