"""Fuse the evidence for a thing's class: of form and detector in one image, and of many images.

In one image, the measured form and the detector each give classes odds against "something else".
What they say of one class is joined as if they erred independently, and the surest class wins with
its share of all odds:

    odds = (1 + o(form)) * (1 + o(network)) - 1        confidence = odds / (1 + sum of all odds)

A detector may vote for several classes of one thing, of which at most one is right: the odds of a
vote are its chance against the chance that none is. So agreement makes a name surer, and a
contradiction makes every name unsure. What the measures rule out never becomes the name; a vote for
it counts for something else.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Final

from vla_deploy.perception.naming.classes import OTHER, Form

NAMED_ODDS: Final = 9.0
"""Of the class that the form names, where it fits no other."""
LOOK_ALIKE_ODDS: Final[Mapping[bool, float]] = {True: 6.0, False: 2.0}
"""Where it fits several, which a detector can tell apart: the named one, the others."""
OTHER_CONFIDENCE: Final = 0.5
SURE_SCORE: Final = 0.5
"""From this score on, a box is right as often as the model was measured to be."""
HIGHEST_CHANCE: Final = 0.97
MISS_WEIGHT: Final = 0.3
"""Share of its recall by which a detector that finds nothing lowers the confidence."""
MAX_EVIDENCE: Final = 24.0
"""As many images outweigh all earlier ones: a thing may be exchanged for another."""


class NameSource(Enum):
    """Say what gave a thing its name."""

    NONE = "nobody"
    FORM = "its form"
    NETWORK = "the network"
    BOTH = "its form and the network"


@dataclass(frozen=True, slots=True, kw_only=True)
class ClassVote:
    """Hold what the detector says of one place: a class, and the chance that this is right."""

    class_name: str
    chance: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Name:
    """Hold a thing's class, how sure that is (0..1), and where it comes from."""

    class_name: str
    confidence: float
    source: NameSource


NO_NAME: Final = Name(class_name=OTHER, confidence=OTHER_CONFIDENCE, source=NameSource.NONE)


def chance_of(score: float, precision: float) -> float:
    """Return the chance that a box is right, of a model that was measured at a precision."""
    return min(HIGHEST_CHANCE, precision * min(1.0, score / SURE_SCORE))


def name_by_form(form: Form, missed_recall: float = 0.0) -> Name:
    """Name a thing by its form alone; `missed_recall` is that of a detector that found nothing."""
    if form.name == OTHER:
        return NO_NAME
    alone = NAMED_ODDS / (1.0 + NAMED_ODDS)
    confidence = alone * (1.0 - MISS_WEIGHT * missed_recall)
    return Name(class_name=form.name, confidence=confidence, source=NameSource.FORM)


def fuse_name(form: Form, votes: Sequence[ClassVote]) -> Name:
    """Name a thing by its form and the detector's votes for its place, one for each class."""
    odds, something_else = _form_odds(form), 1.0
    for class_name, vote_odds in _vote_odds(votes):
        if class_name in form.impossible:
            something_else += vote_odds
        else:
            odds[class_name] = (1.0 + odds.get(class_name, 0.0)) * (1.0 + vote_odds) - 1.0
    best = max(odds, key=lambda name: odds[name], default=OTHER)
    if odds.get(best, 0.0) <= something_else:
        return NO_NAME
    confidence = odds[best] / (something_else + sum(odds.values()))
    return Name(class_name=best, confidence=confidence, source=_source(best, form, votes))


def _vote_odds(votes: Sequence[ClassVote]) -> Iterator[tuple[str, float]]:
    """Yield each class with its chance over the chance that no vote is right."""
    total = sum(vote.chance for vote in votes)
    excess = max(1.0, total / HIGHEST_CHANCE)
    for vote in votes:
        yield vote.class_name, vote.chance / (excess - total)


def _form_odds(form: Form) -> dict[str, float]:
    if form.name == OTHER:
        return {}
    if len(form.fits) == 1:
        return {form.name: NAMED_ODDS}
    return {name: LOOK_ALIKE_ODDS[name == form.name] for name in sorted(form.fits)}


def _source(name: str, form: Form, votes: Sequence[ClassVote]) -> NameSource:
    if all(name != vote.class_name for vote in votes):
        return NameSource.FORM
    return NameSource.BOTH if name in form.fits else NameSource.NETWORK


class NameEvidence:
    """Sum the evidence of many images for each of several names; `weights` default to 1."""

    def __init__(self, otherwise: str, weights: Mapping[str, float] | None = None) -> None:
        self._otherwise = otherwise
        self._weights = weights or {}
        self._evidence: dict[str, float] = {}

    def add(self, name: str) -> None:
        """Count the name that one image gives."""
        self._evidence[name] = self._evidence.get(name, 0.0) + self._weights.get(name, 1.0)
        total = sum(self._evidence.values())
        if total > MAX_EVIDENCE:
            scale = MAX_EVIDENCE / total
            self._evidence = {known: scale * value for known, value in self._evidence.items()}

    def restore(self, shares: Mapping[str, float], images: float) -> None:
        """Restore earlier probabilities, as from so many images."""
        evidence = min(images, MAX_EVIDENCE)
        self._evidence = {name: evidence * share for name, share in shares.items()}

    @property
    def best(self) -> str:
        """Return the likeliest name, the first seen of equals."""
        return max(self._evidence, key=self._evidence.__getitem__, default=self._otherwise)

    def share(self, name: str) -> float:
        """Return the probability of a name, 0 before the first image."""
        total = sum(self._evidence.values())
        return self._evidence.get(name, 0.0) / total if total else 0.0

    def shares(self, count: int) -> dict[str, float]:
        """Return the likeliest names with their probabilities, the likeliest first."""
        ranked = sorted(self._evidence, key=lambda name: (-self._evidence[name], name))
        return {name: self.share(name) for name in ranked[:count]}
