"""Name a thing by two witnesses: its measured form, and a network that looks at the picture.

Each witness gives classes odds against "something else"; what they say of one class is joined as
if they erred independently, and the surest class wins with its share of all odds:

    odds = (1 + o(form)) * (1 + o(network)) - 1        confidence = odds / (1 + sum of all odds)

A network may have several words for one thing, of which one at most is right: the odds of a word
are its chance against the chance that none is.

So agreement makes a name surer and a contradiction makes every name unsure. What the measures rule
out never becomes the name; the network's word for it counts as one for something else.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Final

from vla_deploy.perception.naming.classes import OTHER, Form

NAMED_ODDS: Final = 9.0
"""Of the class that the form names, where it fits no other."""
LOOK_ALIKE_ODDS: Final[Mapping[bool, float]] = {True: 6.0, False: 2.0}
"""Where it fits several, of which a network can tell them apart: the named one, the others."""
OTHER_CONFIDENCE: Final = 0.5
SURE_SCORE: Final = 0.5
"""From this score on, a box is right as often as the model was measured to be."""
HIGHEST_CHANCE: Final = 0.97
SILENCE: Final = 0.3
"""Share of its recall by which a network that says nothing of a thing lowers the confidence."""


class NameSource(Enum):
    """Say who gave a thing its name."""

    NONE = "nobody"
    FORM = "its form"
    NETWORK = "the network"
    BOTH = "its form and the network"


@dataclass(frozen=True, slots=True, kw_only=True)
class ClassVote:
    """Hold what a network says of one place: a class, and the chance that this is right."""

    class_name: str
    chance: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Name:
    """Hold a thing's class, how sure that is (0..1), and who says so."""

    class_name: str
    confidence: float
    source: NameSource


def chance_of(score: float, precision: float) -> float:
    """Return the chance that a box is right, of a model that was measured at a precision."""
    return min(HIGHEST_CHANCE, precision * min(1.0, score / SURE_SCORE))


def by_form(form: Form, silence: float = 0.0) -> Name:
    """Name a thing by its form alone; `silence` is the recall of a network that saw nothing."""
    if form.name == OTHER:
        return Name(class_name=OTHER, confidence=OTHER_CONFIDENCE, source=NameSource.NONE)
    alone = NAMED_ODDS / (1.0 + NAMED_ODDS)
    return Name(
        class_name=form.name, confidence=alone * (1.0 - SILENCE * silence), source=NameSource.FORM
    )


def by_both(form: Form, words: Sequence[ClassVote]) -> Name:
    """Name a thing by its form and what a network says of its place, each class once."""
    odds, something_else = _form_odds(form), 1.0
    for class_name, said in _word_odds(words):
        if class_name in form.impossible:
            something_else += said
        else:
            odds[class_name] = (1.0 + odds.get(class_name, 0.0)) * (1.0 + said) - 1.0
    best = max(odds, key=lambda name: odds[name], default=OTHER)
    if odds.get(best, 0.0) <= something_else:
        return Name(class_name=OTHER, confidence=OTHER_CONFIDENCE, source=NameSource.NONE)
    confidence = odds[best] / (something_else + sum(odds.values()))
    return Name(class_name=best, confidence=confidence, source=_source(best, form, words))


def _word_odds(words: Sequence[ClassVote]) -> Iterator[tuple[str, float]]:
    """Yield each class with its chance over the chance that no word is right."""
    total = sum(word.chance for word in words)
    excess = max(1.0, total / HIGHEST_CHANCE)
    for word in words:
        yield word.class_name, word.chance / (excess - total)


def _form_odds(form: Form) -> dict[str, float]:
    if form.name == OTHER:
        return {}
    if len(form.fits) == 1:
        return {form.name: NAMED_ODDS}
    return {name: LOOK_ALIKE_ODDS[name == form.name] for name in sorted(form.fits)}


def _source(name: str, form: Form, words: Sequence[ClassVote]) -> NameSource:
    if all(name != word.class_name for word in words):
        return NameSource.FORM
    return NameSource.BOTH if name in form.fits else NameSource.NETWORK
