"""Ask which of several things was meant, by what tells them apart in the fewest words.

colour, kind, what it stands on or in, left or right, nearer or farther, size, then their ids
"""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Final

from vla_deploy.planning.errors import Ambiguous
from vla_deploy.planning.understanding.conversation import Candidate
from vla_deploy.planning.understanding.names import Match
from vla_deploy.planning.understanding.phrases import EXTREMES, ORDINALS
from vla_deploy.planning.understanding.selection import MEASURES, by_distance, in_a_row, most
from vla_deploy.world import Thing, Viewpoint

# More than these are no short question.
MOST_CHOICES: Final = 4
# What is not that much nearer than another is not "the nearer one".
LEAST_DISTANCE_M: Final = 0.05

Contrast = Callable[[Sequence[Thing], Viewpoint | None], list[str] | None]


def which_thing(things: Sequence[Thing], view: Viewpoint | None, expression: str) -> Ambiguous:
    """Return the question which of these was meant; the nearest ones come first."""
    asked = list(things)[:MOST_CHOICES]
    words = next(found for contrast in _CONTRASTS if (found := contrast(asked, view)) is not None)
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


def which_hand(held: Mapping[str, str], expression: str) -> Ambiguous:
    """Return the question which of the things in the hands was meant; `held` names them by hand."""
    candidates = [
        Candidate(
            name=f"what is in your {hand} hand",
            words=f"the {said} in my {hand} hand",
            features=frozenset((hand, *said.split())),
        )
        for hand, said in held.items()
    ]
    return Ambiguous(
        f"Which one, {either([one.words for one in candidates])}?", candidates, expression
    )


def which_place(places: Sequence[str], expression: str) -> Ambiguous:
    """Return the question which of these places was meant."""
    candidates = _places(places)
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


def _distinct(words: Sequence[str]) -> list[str] | None:
    return list(words) if len(set(words)) == len(words) and all(words) else None


def _by_colour(things: Sequence[Thing], _: Viewpoint | None) -> list[str] | None:
    same_kind = len({thing.kind for thing in things}) == 1
    words = [f"the {one.colour} {'one' if same_kind else one.kind}" for one in things]
    return _distinct(words) if all(one.colour for one in things) else None


def _by_kind(things: Sequence[Thing], _: Viewpoint | None) -> list[str] | None:
    return _distinct([f"the {one.kind}" for one in things])


def _by_support(things: Sequence[Thing], _: Viewpoint | None) -> list[str] | None:
    return _distinct([_support(one) for one in things])


def _support(thing: Thing) -> str:
    if thing.rests is None:
        return ""
    of = thing.rests.of
    name = of.rpartition("_")[0] if of.rpartition("_")[2].isdigit() else of
    return f"the one {thing.rests.relation} the {name.replace('_', ' ')}"


def _by_side(things: Sequence[Thing], view: Viewpoint | None) -> list[str] | None:
    row = in_a_row(things, view)
    if row is None or len(row) > 3:
        return None
    names = ("left", "middle", "right") if len(row) == 3 else ("left", "right")
    sides = [names[row.index(one)] for one in things]
    return ["the middle one" if side == "middle" else f"the one on the {side}" for side in sides]


def _by_distance(things: Sequence[Thing], view: Viewpoint | None) -> list[str] | None:
    if view is None or len(things) != 2:
        return None
    here = (view.x_m, view.y_m)
    near, far = (math.dist(one.xy_m, here) for one in things)
    if abs(near - far) < LEAST_DISTANCE_M:
        return None
    return ["the nearer one", "the farther one"][:: 1 if near < far else -1]


def _by_size(things: Sequence[Thing], _: Viewpoint | None) -> list[str] | None:
    if len(things) != 2 or len(most(things, "big")) != 1:
        return None
    return ["the big one" if one is most(things, "big")[0] else "the small one" for one in things]


def _by_name(things: Sequence[Thing], _: Viewpoint | None) -> list[str]:
    return [one.thing_id for one in things]


def _by_colour_there(things: Sequence[Thing], _: Viewpoint | None) -> list[str] | None:
    words = [_support(one).replace("the one", f"the {one.colour} one", 1) for one in things]
    return _distinct(words) if len({one.kind for one in things}) == 1 else None


_CONTRASTS: Final[tuple[Contrast, ...]] = (
    _by_colour, _by_kind, _by_support, _by_side, _by_distance, _by_size, _by_colour_there, _by_name,
)  # fmt: skip


def _features(
    thing: Thing, said: str, things: Sequence[Thing], view: Viewpoint | None
) -> frozenset[str]:
    """Return every word that is true of a thing, whichever way the question was put."""
    words = {*said.split(), thing.kind, thing.colour, thing.thing_id, *_support(thing).split()}
    for contrast in (_by_side, _by_distance, _by_size):
        told = contrast(things, view)
        if told is not None:
            words |= set(told[list(things).index(thing)].split())
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
