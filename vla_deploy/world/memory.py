"""Remember where things were: is it still there, which place is that, where to look first.

A thing that nobody watches may be moved by somebody. How soon depends on what it is: keys and
phones wander, a box stays. The probability that it is still there halves in the time that the table
gives. What is left of it is shared out among the places where things are kept.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final

from vla_deploy.world.query import Query
from vla_deploy.world.thing import FLOOR, Snapshot, Thing

Point = tuple[float, float]

HOUR_S: Final = 3600.0
HALF_LIFE_S: Final[Mapping[str, float]] = MappingProxyType(
    {
        "keys": 1 * HOUR_S, "phone": 1 * HOUR_S, "cup": 2 * HOUR_S, "ball": 4 * HOUR_S,
        "remote": 4 * HOUR_S, "bottle": 8 * HOUR_S, "can": 8 * HOUR_S, "book": 24 * HOUR_S,
        "bowl": 24 * HOUR_S, "box": 168 * HOUR_S,
    }
)  # fmt: skip
OTHER_HALF_LIFE_S: Final = 4 * HOUR_S
# A thing that has left its place comes back to it now and then.
RETURNS: Final = 0.2
LEAST_GUESS: Final = 0.02
KEPT: Final = "things are kept there"


@dataclass(frozen=True, slots=True, kw_only=True)
class Guess:
    """Say where a thing may be, how probably, and why one thinks so."""

    thing_id: str
    place: str
    position_m: tuple[float, float, float] | None
    probability: float
    why: str


def still_there(thing: Thing, unseen_s: float) -> float:
    """Return the probability that a thing is where it was seen last."""
    if thing.held_by:
        return 1.0
    half_life_s = HALF_LIFE_S.get(thing.kind, OTHER_HALF_LIFE_S)
    return thing.confidence * math.exp2(-max(0.0, unseen_s) / half_life_s)


def place_of(thing: Thing, places: Mapping[str, Point]) -> str:
    """Return where a thing is in words: the hand, container or furniture, else the nearest place.

    `places` maps the names of places to points of the map.
    """
    if thing.held_by:
        return f"{thing.held_by} hand"
    if thing.rests is not None and thing.rests.of != FLOOR:
        return thing.rests.of
    nearest = min(places, key=lambda name: math.dist(places[name], thing.xy_m), default="")
    if not nearest:
        return "unknown"
    return f"near {nearest}" if thing.rests is None else f"floor near {nearest}"


def where_to_look(query: Query, snapshot: Snapshot, places: Mapping[str, Point]) -> list[Guess]:
    """Return where the things meant may be, the likeliest first.

    Places of which nothing is told share what probability is left.
    """
    here = [thing for thing in snapshot.things if query.fits(thing)]
    guesses = [_guess(thing, snapshot, places, 1.0, "") for thing in here]
    gone = [lost for lost in snapshot.lost if query.fits(lost.thing)]
    guesses += [_guess(lost.thing, snapshot, places, RETURNS, lost.cause) for lost in gone]
    told = {guess.place for guess in guesses}
    unknown = [name for name in places if name not in told]
    left = 1.0 - max((guess.probability for guess in guesses), default=0.0)
    guesses += [
        Guess(thing_id="", place=name, position_m=None, probability=left / len(unknown), why=KEPT)
        for name in unknown
    ]
    ranked = sorted(guesses, key=lambda guess: -guess.probability)
    return [guess for guess in ranked if guess.probability >= LEAST_GUESS]


def _guess(
    thing: Thing, snapshot: Snapshot, places: Mapping[str, Point], share: float, cause: str
) -> Guess:
    unseen_s = snapshot.unseen_s(thing)
    return Guess(
        thing_id=thing.thing_id,
        place=place_of(thing, places),
        position_m=thing.position_m,
        probability=share * still_there(thing, unseen_s),
        why=", ".join(word for word in (cause, seen_words(unseen_s)) if word),
    )


def seen_words(unseen_s: float) -> str:
    """Return when a thing was seen, as people say it."""
    if unseen_s < 2.0:
        return "in view"
    if unseen_s < 120.0:
        return f"seen {unseen_s:.0f} s ago"
    return f"seen {unseen_s / 60.0:.0f} min ago"
