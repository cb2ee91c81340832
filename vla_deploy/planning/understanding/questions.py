"""Ask which of several things was meant, by what tells them apart in the fewest words.

colour, kind, what it stands on or in, left or right, nearer or farther, size, then their ids
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Final

from vla_deploy.planning.errors import Ambiguous
from vla_deploy.planning.understanding.conversation import Candidate, Mention
from vla_deploy.planning.understanding.names import Match
from vla_deploy.planning.understanding.phrases import EXTREMES, ORDINALS
from vla_deploy.planning.understanding.selection import MEASURES, by_distance, in_a_row, most
from vla_deploy.world import Thing, Viewpoint

# More than these are no short question.
MOST_CHOICES: Final = 4
# What is not that much nearer than another is not "the nearer one".
LEAST_DISTANCE_M: Final = 0.05


def which_thing(things: Sequence[Thing], view: Viewpoint | None, expression: str) -> Ambiguous:
    """Return the question which of these was meant; the nearest ones come first."""
    asked = list(things)[:MOST_CHOICES]
    words = next(_contrasts(asked, view))
    candidates = [
        Candidate(name=thing.thing_id, words=said, features=_features(thing, said, asked, view))
        for thing, said in zip(asked, words, strict=True)
    ]
    # What the question has no room for may be the answer all the same.
    candidates += [
        Candidate(
            name=thing.thing_id, words=f"the {thing}", features=_features(thing, "", [], None)
        )
        for thing in things[MOST_CHOICES:]
    ]
    kinds = {thing.kind for thing in asked}
    noun = next(iter(kinds)) if len(kinds) == 1 else "one"
    return Ambiguous(f"Which {noun}, {either(words)}?", candidates, expression)


def which_hand(held: Mapping[str, Mention], expression: str) -> Ambiguous:
    """Return the question which of the things in the hands was meant; `held` names them by hand."""
    candidates = [
        Candidate(
            name=f"what is in your {hand} hand",
            words=f"the {one.said} in my {hand} hand",
            features=frozenset((hand, *one.said.split())),
        )
        for hand, one in held.items()
    ]
    return _which_one(candidates, expression)


def which_place(places: Sequence[str], expression: str) -> Ambiguous:
    """Return the question which of these places was meant."""
    return _which_one(_places(places), expression)


def _which_one(candidates: Sequence[Candidate], expression: str) -> Ambiguous:
    words = [one.words for one in candidates[:MOST_CHOICES]]
    return Ambiguous(f"Which one, {either(words)}?", candidates, expression)


def where(places: Sequence[str], expression: str) -> Ambiguous:
    """Return the question where "there" is when nobody has spoken of a place."""
    return Ambiguous("Where do you mean?", _places(places), expression)


def _places(names: Sequence[str]) -> list[Candidate]:
    return [
        Candidate(
            name=name, words=f"the {name.replace('_', ' ')}", features=frozenset(name.split("_"))
        )
        for name in names
    ]


def did_you_mean(match: Match, expression: str) -> Ambiguous:
    """Return the question whether a word that sounds like a known one means that."""
    words = [f"the {known.replace('_', ' ')}" for known in match.known]
    candidates = [
        Candidate(
            name=expression.replace(match.word, known),
            words=said,
            features=frozenset(known.split()),
        )
        for known, said in zip(match.known, words, strict=True)
    ]
    return Ambiguous(f"Did you mean {either(words)}?", candidates, expression)


def either(words: Sequence[str]) -> str:
    """Return "the red one, the blue one or the white one"."""
    return " or ".join(part for part in (", ".join(words[:-1]), words[-1]) if part)


def _contrasts(things: Sequence[Thing], view: Viewpoint | None) -> Iterator[list[str]]:
    """Yield the ways to call each of some things that tell them apart, the shortest first."""
    kinds = {one.kind for one in things}
    nouns = ["one" if len(kinds) == 1 else one.kind for one in things]
    there = [_support(one) for one in things]
    coloured = [f"the {one.colour} {noun}" for one, noun in zip(things, nouns, strict=True)]
    ways = [
        coloured if all(one.colour for one in things) else [],
        [f"the {one.kind}" for one in things],
        [f"the one {where}" for where in there] if all(there) else [],
        _by_side(things, view),
        _by_distance(things, view),
        _by_size(things),
        [f"{words} {where}" for words, where in zip(coloured, there, strict=True)]
        if all(there) and len(kinds) == 1
        else [],
    ]
    yield from (words for words in ways if len({*words}) == len(things))
    yield [one.thing_id for one in things]


def _support(thing: Thing) -> str:
    return "" if thing.rests is None else thing.rests.words


def _by_side(things: Sequence[Thing], view: Viewpoint | None) -> list[str]:
    row = in_a_row(things, view)
    if row is None or len(row) > 3:
        return []
    sides = ("the one on the left", *["the middle one"][: len(row) - 2], "the one on the right")
    return [sides[row.index(one)] for one in things]


def _by_distance(things: Sequence[Thing], view: Viewpoint | None) -> list[str]:
    if view is None or len(things) != 2:
        return []
    near, far = (math.dist(one.xy_m, (view.x_m, view.y_m)) for one in things)
    if abs(near - far) < LEAST_DISTANCE_M:
        return []
    return ["the nearer one", "the farther one"][:: 1 if near < far else -1]


def _by_size(things: Sequence[Thing]) -> list[str]:
    big = most(things, "big")
    if len(things) != 2 or len(big) != 1:
        return []
    return ["the big one" if one is big[0] else "the small one" for one in things]


def _features(
    thing: Thing, said: str, things: Sequence[Thing], view: Viewpoint | None
) -> frozenset[str]:
    """Return every word that is true of a thing, whichever way the question was put."""
    at = things.index(thing) if thing in things else None
    told = [] if at is None else [words[at] for words in _contrasts(things, view)]
    words = {*" ".join((said, _support(thing), *told)).split()}
    words |= {thing.kind, thing.colour, thing.thing_id}
    words |= {word for word in MEASURES if most(things, word) == [thing]}
    words |= {word for word, measure in EXTREMES.items() if most(things, measure) == [thing]}
    words |= {"large"} if "big" in words else set()
    words |= {"little"} if "small" in words else set()
    words |= {*_by_nearness(thing, things, view), *_in_row(thing, things, view)}
    return frozenset(word for word in words if word)


def _by_nearness(thing: Thing, things: Sequence[Thing], view: Viewpoint | None) -> Iterator[str]:
    """Yield "nearest" and the like for what clearly is that."""
    if view is None or len(things) < 2:
        return
    here = (view.x_m, view.y_m)
    away_m = [math.dist(one.xy_m, here) for one in by_distance(things, here)]
    own_m = math.dist(thing.xy_m, here)
    if own_m == away_m[0] and away_m[1] - own_m >= LEAST_DISTANCE_M:
        yield from ("nearest", "closest", "nearer", "closer")
    if own_m == away_m[-1] and own_m - away_m[-2] >= LEAST_DISTANCE_M:
        yield from ("farthest", "furthest", "farther", "further")


def _in_row(thing: Thing, things: Sequence[Thing], view: Viewpoint | None) -> Iterator[str]:
    """Yield "leftmost" for the end of a row, and "second_from_left" for every place in it."""
    row = in_a_row(things, view) or []
    for side, counted in (("left", row), ("right", row[::-1])):
        place = counted.index(thing) + 1 if row else 0
        yield from (side, f"{side}most") if place == 1 else ()
        yield from (from_side(word, side) for word, at in ORDINALS.items() if at == place)


def from_side(ordinal: str, side: str) -> str:
    """Return the word by which candidates go by their place in a row."""
    return f"{ordinal}_from_{side}"
