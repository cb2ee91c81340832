"""Ask which of several things was meant, by what tells them apart in the fewest words.

colour, kind, what it stands on or in, left or right, then their ids
"""

from collections.abc import Iterator, Mapping, Sequence
from typing import Final

from vla_deploy.planning.errors import Ambiguous
from vla_deploy.planning.understanding.conversation import Candidate, Mention
from vla_deploy.planning.understanding.names import Match
from vla_deploy.planning.understanding.selection import in_a_row
from vla_deploy.world import Thing, Viewpoint

# More than these are no short question.
MOST_CHOICES: Final = 4


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
            features=frozenset((hand, "hand", *one.said.split())),
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


def _features(
    thing: Thing, said: str, things: Sequence[Thing], view: Viewpoint | None
) -> frozenset[str]:
    """Return every word that is true of a thing, whichever way the question was put."""
    told = [words[things.index(thing)] for words in _contrasts(things, view)] if things else []
    words = {*" ".join((said, _support(thing), *told)).split()}
    words |= {thing.kind, thing.colour, thing.thing_id}
    row = in_a_row(things, view)
    words |= {"left", "leftmost"} if row and row[0] == thing else set()
    words |= {"right", "rightmost"} if row and row[-1] == thing else set()
    return frozenset(word for word in words if word)
