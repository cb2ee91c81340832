"""Ask which of several things was meant, by what tells them apart in the fewest words.

colour, kind, what it stands on or in, left or right, then their ids
"""

from collections.abc import Iterator, Sequence
from typing import Final

from vla_deploy.planning.errors import Ambiguous
from vla_deploy.planning.understanding.conversation import Candidate
from vla_deploy.planning.understanding.fitting import in_a_row
from vla_deploy.world import Thing, Viewpoint

# More than these are no short question.
MOST_CHOICES: Final = 4


def which_thing(things: Sequence[Thing], view: Viewpoint | None, expression: str) -> Ambiguous:
    """Return the question which of these was meant; the nearest ones come first."""
    asked, row = list(things)[:MOST_CHOICES], in_a_row(things, view)
    ways = list(_contrasts(asked, view))
    # What the question has no room for may be the answer all the same.
    called = [*zip(*ways, strict=True), *((f"the {one}",) for one in things[MOST_CHOICES:])]
    candidates = [
        Candidate(name=thing.thing_id, words=words[0], features=_features(thing, words, row or []))
        for thing, words in zip(things, called, strict=True)
    ]
    noun = asked[0].kind if len({thing.kind for thing in asked}) == 1 else "one"
    return Ambiguous(f"Which {noun}, {either(ways[0])}?", candidates, expression)


def _features(thing: Thing, called: Sequence[str], row: Sequence[Thing]) -> frozenset[str]:
    """Return every word that is true of a thing, whichever way the question was put."""
    told = [thing.kind, thing.colour, thing.thing_id, _support(thing), *called]
    told += ["left leftmost"] if row[:1] == [thing] else []
    told += ["right rightmost"] if row[-1:] == [thing] else []
    return frozenset(" ".join(told).split())


def _support(thing: Thing) -> str:
    if thing.held_by:
        return f"in my {thing.held_by} hand"
    return "" if thing.rests is None else thing.rests.words


def which_place(places: Sequence[str], expression: str, question: str = "") -> Ambiguous:
    """Return the question which of these places was meant."""
    candidates = [
        Candidate(
            name=name, words=f"the {name.replace('_', ' ')}", features=frozenset(name.split("_"))
        )
        for name in places
    ]
    words = either([one.words for one in candidates[:MOST_CHOICES]])
    return Ambiguous(question or f"Which one, {words}?", candidates, expression)


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
        [f"{words} {where}" for words, where in zip(coloured, there, strict=True)]
        if all(there) and len(kinds) == 1
        else [],
    ]
    yield from (words for words in ways if len({*words}) == len(things))
    yield [one.thing_id for one in things]


def _by_side(things: Sequence[Thing], view: Viewpoint | None) -> list[str]:
    row = in_a_row(things, view)
    if row is None or len(row) > 3:
        return []
    sides = ("the one on the left", *["the middle one"][: len(row) - 2], "the one on the right")
    return [sides[row.index(one)] for one in things]
