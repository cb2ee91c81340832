from collections.abc import Callable

import pytest

from vla_deploy.world import Snapshot, Thing, parse_query
from vla_deploy.world.memory import HOUR_S, place_of, still_there, where_to_look
from vla_deploy.world.thing import Lost, Rest

Make, MakeWorld = Callable[..., Thing], Callable[..., Snapshot]
PLACES = {"coffee_table": (2.0, 0.0), "kitchen_table": (6.0, 4.0), "side_table": (4.0, 0.0)}
NOW_NS = 10 * round(HOUR_S) * 1_000_000_000


def ago(hours: float) -> int:
    return NOW_NS - round(hours * HOUR_S * 1e9)


def test_keys_wander_sooner_than_a_box(thing: Make) -> None:
    keys, box = thing("keys", 0, 0), thing("box", 0, 0)
    assert still_there(keys, 0.0) == 1.0
    assert still_there(keys, HOUR_S) == pytest.approx(0.5)
    assert still_there(box, HOUR_S) > 0.99
    assert still_there(thing("keys", 0, 0, held_by="left"), 24 * HOUR_S) == 1.0


@pytest.mark.parametrize(
    ("changes", "place"),
    [
        ({"rests": Rest("on", "coffee_table")}, "coffee_table"),
        ({"rests": Rest("in", "box_1")}, "box_1"),
        ({"rests": Rest("on", "floor")}, "floor near side_table"),
        ({}, "near side_table"),
        ({"held_by": "right"}, "right hand"),
    ],
)
def test_a_place_in_words(thing: Make, changes: dict[str, object], place: str) -> None:
    assert place_of(thing("cup", 3.9, 0.2, **changes), PLACES) == place


def test_a_place_without_any_names(thing: Make) -> None:
    assert place_of(thing("cup", 3.9, 0.2), {}) == "unknown"


def test_one_looks_first_where_it_was_seen_and_last_where_it_was_missed(
    thing: Make, world: MakeWorld
) -> None:
    keys = thing("keys", 2.0, 0.0, rests=Rest("on", "coffee_table"), last_seen_ns=ago(0.5))
    gone = thing("keys_2", 6.0, 4.0, rests=Rest("on", "kitchen_table"), last_seen_ns=ago(0.1))
    lost = Lost(thing=gone, cause="its place was seen without it")
    snapshot = world(keys, stamp_ns=NOW_NS, lost=(lost,))
    guesses = where_to_look(parse_query("keys"), snapshot, PLACES)
    assert [guess.place for guess in guesses] == ["coffee_table", "side_table", "kitchen_table"]
    assert guesses[0].probability == pytest.approx(0.5**0.5)
    assert guesses[0].why == "seen 30 min ago"
    assert "seen without it" in guesses[2].why


def test_of_what_was_never_seen_all_places_are_as_good(thing: Make, world: MakeWorld) -> None:
    guesses = where_to_look(parse_query("phone"), world(thing("cup", 0, 0)), PLACES)
    assert {guess.place for guess in guesses} == set(PLACES)
    assert sum(guess.probability for guess in guesses) == pytest.approx(1.0)


def test_confidence_decays_until_the_other_places_are_likelier(
    thing: Make, world: MakeWorld
) -> None:
    keys = thing("keys", 2.0, 0.0, rests=Rest("on", "coffee_table"), last_seen_ns=ago(8.0))
    guesses = where_to_look(parse_query("keys"), world(keys, stamp_ns=NOW_NS), PLACES)
    assert "coffee_table" not in [guess.place for guess in guesses]
    assert len(guesses) == 2
