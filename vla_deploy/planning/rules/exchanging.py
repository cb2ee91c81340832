"""Exchange one part of a clause for another: "the blue one", "in the box", "and the ball too".

What takes the place of a cup and is only "the blue one" is a cup.
"""

import re
from collections.abc import Iterator
from typing import Final

from vla_deploy.planning.asking import Request
from vla_deploy.planning.errors import UnknownObject
from vla_deploy.planning.references import match_place
from vla_deploy.planning.rules.building import Groups, is_seen
from vla_deploy.planning.rules.fits import Fit, fit_of, known_fit
from vla_deploy.planning.understanding.expressions import read_expression
from vla_deploy.planning.understanding.phrases import PRONOUNS
from vla_deploy.planning.understanding.quantities import number_of
from vla_deploy.planning.understanding.setting import Setting

# What of a clause can be exchanged by a part alone.
_EXCHANGED: Final = frozenset({"object", "place", "destination", "quantity", "way", "what"})
_MANNERS: Final = frozenset({"arm", "pace", "speed"})
_ONE: Final = re.compile(r"(?<=\w )one(s?)\b")
_HAND: Final = re.compile(r"(?:(?:in|with) )?(?:the |your )?(?P<side>left|right)(?: hand| one)?")
_NAMED_HAND: Final = re.compile(r"\b(?:left|right)(?= hand\b)")
# "..., the purple one I need here": another thing is told of, and nothing is asked for it.
_TOLD_OF: Final = re.compile(
    r"(?:the|my|that) (?:\w+ ){1,2}(?:one )?(?:i|we|he|she|they|my \w+|our \w+)"
    r"(?:'\w+)? (?:\w+ )*\w+$"
)
_PREPOSITION: Final = re.compile(r"^(?:in|into|on|onto|at|to|from|with|for) ")
_BEHIND: Final = re.compile(r" (?:in|into|on|onto|at|to|from|with|for) $")


def continued(said: str, clause: str, thing: str, request: Request) -> tuple[str, Fit] | None:
    """Return a clause with other words for its thing: "pick up the cup, then the ball".

    None where that is nothing that is known.
    """
    if not thing or thing not in clause or said.split()[:1] == ["to"]:
        return None
    if tells_of_another(said):
        return None
    verb, own = clause[: clause.index(thing)], of_kind(said, thing, request)
    if _PREPOSITION.match(said) and _BEHIND.search(verb):
        return None
    # "The cup goes in the box" begins with its thing, which alone asks for nothing.
    wholes = (*([f"{verb}{own}"] if verb else ()), clause.replace(thing, own, 1))
    found = [(whole, fit) for whole in wholes if (fit := known_fit(whole, request)) is not None]
    before = fit_of(clause, request)
    said_before = set() if before is None else before.groups.keys() - _MANNERS
    # "Take the cup to the table, and the ball" takes the ball to the table, too.
    full = [one for one in found if one[1].groups.keys() >= said_before]
    return next(iter(full or found), None)


def tells_of_another(part: str) -> bool:
    """Tell whether a part tells of another thing: "the purple one I need here"."""
    return _TOLD_OF.match(part) is not None


def corrected(said: str, clause: str, request: Request) -> str:
    """Return a clause with what was said in the place of what it corrects.

    That is the last part of it of the same kind, what is in sight before what is not; a clause of
    its own stands for itself.
    """
    if known_fit(said, request) is not None:
        return said
    swapped = _with_other_hand(said, clause)
    if swapped and known_fit(swapped, request) is not None:
        return swapped
    known = [
        (whole, own)
        for whole, own in _exchanges(said, clause, request)
        if known_fit(whole, request) is not None
    ]
    seen = [whole for whole, own in known if _is_certain(own, request)]
    return (seen or [whole for whole, _ in known] or [said])[0]


def of_kind(said: str, instead_of: str, request: Request) -> str:
    """Return "the blue cup" for "the blue one" where it stands for a cup."""
    if said in PRONOUNS or not _ONE.search(said):
        return said
    try:
        query = read_expression(instead_of, Setting(request).furniture).query
    except UnknownObject:
        return said
    kind = query.thing_id.rpartition("_")[0] or query.kind
    return _ONE.sub(rf"{kind}\1", said) if query.is_named else said


def _with_other_hand(said: str, clause: str) -> str:
    """Return "take it in your right hand" for "the right" after "take it in your left hand"."""
    hand, named = _HAND.fullmatch(said), _NAMED_HAND.search(clause)
    if hand is None or named is None:
        return ""
    return f"{clause[: named.start()]}{hand['side']}{clause[named.end() :]}"


def _with_unit(words: str, instead_of: str) -> str:
    """Return "60 degrees" for "60" where it stands for "30 degrees"."""
    before, _, unit = instead_of.rpartition(" ")
    is_amount = bool(before) and number_of(before) is not None and number_of(words) is not None
    return f"{words} {unit}" if is_amount else words


def _exchanges(said: str, clause: str, request: Request) -> Iterator[tuple[str, str]]:
    """Yield each clause that an exchange can make, and the words in it; the last part first."""
    before = fit_of(clause, request)
    groups: Groups = {} if before is None else before.groups
    named = [value for name, value in groups.items() if name in _EXCHANGED and value]
    if "relation" in groups:
        named.append(f"{groups['relation']} {groups['destination']}")
    for words in dict.fromkeys((said, _PREPOSITION.sub("", said))):
        for value in sorted(named, key=clause.rfind, reverse=True):
            at, own = clause.rfind(value), _with_unit(of_kind(words, value, request), value)
            # "In the bedroom" takes the place of "in the kitchen", not of "the kitchen".
            if not (_PREPOSITION.match(words) and _BEHIND.search(clause[:at])):
                yield clause[:at] + own + clause[at + len(value) :], own


def _is_certain(words: str, request: Request) -> bool:
    """Tell whether words are the name of a place, or of something in sight."""
    words = _PREPOSITION.sub("", words)
    return match_place(words, request.world.places) is not None or is_seen(words, request)
