"""Sentences written out whole become commands with the answer that their line tells."""

from random import Random

import pytest

from training.planner.sentences.grammar import PatternInvalid
from training.planner.sentences.telling import (
    AFTER,
    BEFORE,
    Mark,
    load_remarks,
    load_told,
    read_frame,
)


def test_a_line_gives_steps_words_and_marks() -> None:
    frame = read_frame('put how="next to" | Well, {what:thing} goes by {where} – thanks!')
    assert frame.steps == ({"do": "put", "how": "next to"},)
    several = read_frame('move way=forward by="half a metre" | half a metre on')
    assert several.steps == ({"do": "move", "way": "forward", "by": "half a metre"},)
    words = [part for part in frame.parts if isinstance(part, str)]
    marks = [(one.slot.field, one.slot.source) for one in frame.parts if isinstance(one, Mark)]
    assert words == ["well", "goes", "by", "thanks"]
    assert marks == [("what", "thing"), ("where", "where")]


def test_words_of_a_slot_belong_to_their_step() -> None:
    frame = read_frame("pick ; go | grab {1.what:thing} and off to {2.where:place}")
    clauses, sentence = frame.drawn(Random(3))
    assert [one.step["do"] for one in clauses] == ["pick", "go"]
    assert {one.owner for one in sentence} == {None, (0, "what"), (1, "where")}


def test_the_second_step_may_say_it_of_what_the_first_has_named() -> None:
    frame = read_frame("pick ; put how=in | take {1.what:thing} and stick {2.what} in {2.where}")
    drawn = [frame.drawn(Random(seed))[1] for seed in range(30)]
    named = {" ".join(one.text for one in each if one.owner == (1, "what")) for each in drawn}
    assert {"it", "that"} & named and len(named) > 5


@pytest.mark.parametrize(
    "line",
    [
        "pick take {what}",
        "steal | take {what}",
        "pick | take it",
        "pick | take {2.what}",
        "pick | take {what:unheard}",
        "pick | take {colour}",
        "pick arm= | take {what}",
        "find how=in | find {what}",
    ],
)
def test_a_line_that_is_none_is_refused(line: str) -> None:
    with pytest.raises(PatternInvalid, match=r"\|" if "|" in line else "SENTENCE"):
        read_frame(line)


def test_those_kept_back_are_others() -> None:
    told, kept = load_told(held_out=False), load_told(held_out=True)
    assert len(told) > 5 * len(kept) > 0
    assert {repr(one) for one in kept}.isdisjoint(repr(one) for one in told)


@pytest.mark.parametrize("where", [BEFORE, AFTER])
def test_remarks_are_words(where: str) -> None:
    told, kept = (load_remarks(where, held_out=one) for one in (False, True))
    assert len(told) > 5 * len(kept) > 0
    assert all(told) and all(kept)
