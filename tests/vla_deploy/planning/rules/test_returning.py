"""A thing goes back to where it was known to be; where nobody knows, the robot says so."""

from dataclasses import replace
from typing import TYPE_CHECKING

import pytest

from vla_deploy.memory.episode import LastSeen
from vla_deploy.planning.errors import NotAble
from vla_deploy.world import Snapshot

if TYPE_CHECKING:
    from conftest import Flat

SEEN = LastSeen(
    run_id="r0", thing_id="cup_9", kind="cup", colour="red", place="side_table",
    position_m=(4.2, 0.5, 0.5), seen_s=1.0,
)  # fmt: skip


def held(flat: "Flat", name: str) -> Snapshot:
    things = tuple(
        replace(one, rests=None, held_by="left") if one.thing_id == name else one
        for one in flat.things
    )
    return Snapshot(stamp_ns=0, things=things)


@pytest.mark.parametrize(
    "text",
    ["put it back where it was", "set that back where you found it", "put the red cup back"],
)
def test_it_goes_back_to_where_it_was_when_it_was_taken(flat: "Flat", text: str) -> None:
    talk = flat.after("pick up the red cup", "go to the side table")
    changes = {"scene": held(flat, "cup_1"), "holding": {"left": "cup"}, "conversation": talk}
    assert flat.does(text, **changes) == "place coffee_table on"


def test_the_memory_of_places_knows_it_too(flat: "Flat") -> None:
    changes = {"scene": held(flat, "cup_1"), "holding": {"left": "cup"}, "last_seen": (SEEN,)}
    assert flat.does("return it to where it was", **changes) == "place side_table on"


@pytest.mark.parametrize(
    "last_seen",
    [(), (replace(SEEN, colour="blue"),), (replace(SEEN, place="left hand"),)],
)
def test_what_nobody_remembers_is_told(flat: "Flat", last_seen: tuple[LastSeen, ...]) -> None:
    changes = {"scene": held(flat, "cup_1"), "holding": {"left": "cup"}, "last_seen": last_seen}
    with pytest.raises(NotAble, match="I do not remember where it was"):
        flat.does("put it back where it was", **changes)
