"""Define what a model may claim of a scene, and weigh it against what was measured.

Claims add names and doubts, never abilities. A thing that the robot has not measured has no id and
is not graspable, whatever is claimed of it. What was measured keeps its place, and its name where
it was recognised.
"""

import re
from collections.abc import Iterable, Iterator
from typing import Annotated, Final, Literal

from pydantic import AfterValidator, BaseModel, ConfigDict, Field

from vla_deploy.analysis.document import (
    AnalysedObject,
    AnalysedRelation,
    Distance,
    EvidenceSource,
    SceneAnalysis,
    Side,
    SizeClass,
)
from vla_deploy.feasibility.verdict import Feasible, Ratio, Task
from vla_deploy.world.vocabulary import ANY_CLASS, OBJECT_CLASSES, SYNONYMS

MOST_OBJECTS: Final = 60
MOST_RELATIONS: Final = 120
MOST_SENTENCES: Final = 6
_NAME_CHARACTERS: Final = 40
_SENTENCE_CHARACTERS: Final = 160
_NOT_IN_NAMES: Final = re.compile(r"[^\w \-']+")
# The most confidence that a claim alone gives, and the factor for one that is contradicted.
MOST_UNMEASURED: Final = 0.3
DOUBT: Final = 0.5
_OPPOSITE: Final = frozenset(
    {frozenset({Side.LEFT, Side.RIGHT}), frozenset({Distance.NEAR, Distance.FAR})}
)
_DIGITS: Final = 3


def _name(text: str) -> str:
    """Keep what a name is made of: a model may read whole sentences off things."""
    return " ".join(_NOT_IN_NAMES.sub(" ", text).split())[:_NAME_CHARACTERS].strip()


def _sentence(text: str) -> str:
    printable = "".join(sign if sign.isprintable() else " " for sign in text)
    return " ".join(printable.split())[:_SENTENCE_CHARACTERS].strip()


Name = Annotated[str, AfterValidator(_name)]
Sentence = Annotated[str, AfterValidator(_sentence)]
Sentences = Annotated[tuple[Sentence, ...], Field(max_length=MOST_SENTENCES)]


class _Claim(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class ClaimedObject(_Claim):
    """Claim a thing; `id` is that of the scene document, null for one that is not in it."""

    id: Name | None
    name: Name
    colour: Name
    side: Side
    distance: Distance
    size: SizeClass
    confidence: Ratio


class ClaimedRelation(_Claim):
    """Claim how two things lie to each other."""

    subject: Name
    relation: Literal[
        "in", "on", "under", "next to", "left of", "right of", "in front of", "behind"
    ]
    other: Name


class ClaimedTask(_Claim):
    """Claim whether the goal can be reached."""

    feasible: bool
    confidence: Ratio
    reason: Sentence
    prerequisites: Sentences
    obstacles: Sentences
    alternatives: Sentences


class SceneClaims(_Claim):
    """Hold all that a model claims; it has no field that could ask the robot to do anything."""

    objects: Annotated[tuple[ClaimedObject, ...], Field(max_length=MOST_OBJECTS)]
    relations: Annotated[tuple[ClaimedRelation, ...], Field(max_length=MOST_RELATIONS)]
    task: ClaimedTask | None


def weighed(measured: SceneAnalysis, claims: SceneClaims, analyser: str) -> SceneAnalysis:
    """Return the analysis that both give together."""
    pairs = dict(_pairs(measured.objects, claims.objects))
    objects = [_named(one, pairs.get(one.id)) for one in measured.objects]
    matched = {id(claim) for claim in pairs.values()}
    extra = [_unmeasured(one) for one in claims.objects if id(one) not in matched and one.name]
    known = {one.id for one in objects} | {one.name for one in extra}
    relations = _relations(measured.relations, claims.relations, known)
    return measured.model_copy(
        update={
            "analyser": analyser,
            "objects": (*objects, *extra),
            "relations": (*measured.relations, *relations),
            "task": _task(measured.task, claims.task),
        }
    )


def _pairs(
    measured: Iterable[AnalysedObject], claims: Iterable[ClaimedObject]
) -> Iterator[tuple[str | None, ClaimedObject]]:
    """Pair claims with measured things: by id first, then by what they are and where."""
    left = {one.id: one for one in measured}
    others = []
    for claim in claims:
        thing = left.get(claim.id) if claim.id else None
        if thing is not None and _may_be(thing, claim):
            del left[thing.id]
            yield thing.id, claim
        else:
            others.append(claim)
    for claim in others:
        alike = (one for one in left.values() if _is_alike(one, claim))
        thing = None if claim.id else next(alike, None)
        if thing is not None:
            del left[thing.id]
            yield thing.id, claim


def _may_be(thing: AnalysedObject, claim: ClaimedObject) -> bool:
    """Return whether a claim does not contradict where a thing is."""
    sides = frozenset({thing.side, claim.side})
    distances = frozenset({thing.distance, claim.distance})
    return sides not in _OPPOSITE and distances not in _OPPOSITE


def _is_alike(thing: AnalysedObject, claim: ClaimedObject) -> bool:
    same_kind = thing.name in _kinds(claim.name)
    return same_kind and thing.colour == claim.colour.lower() and _may_be(thing, claim)


def _kinds(name: str) -> set[str]:
    """Return the kinds that the words of a name mean: a coffee mug is a cup."""
    words = name.lower().split()
    return {SYNONYMS.get(word, word) for word in words} & set(OBJECT_CLASSES)


def _named(thing: AnalysedObject, claim: ClaimedObject | None) -> AnalysedObject:
    """Return a measured thing with what a model says of its name."""
    if claim is None or not claim.name:
        return thing
    if thing.name == ANY_CLASS:
        sure = min(thing.confidence, claim.confidence)
        changes = {"name": claim.name, "confidence": sure, "source": EvidenceSource.BOTH}
        return thing.model_copy(update=changes)
    kinds = _kinds(claim.name)
    if not kinds or thing.name in kinds:
        return thing.model_copy(update={"source": EvidenceSource.BOTH})
    doubted = round(thing.confidence * DOUBT, _DIGITS)
    return thing.model_copy(update={"confidence": doubted})


def _unmeasured(claim: ClaimedObject) -> AnalysedObject:
    return AnalysedObject(
        id=None,
        name=claim.name,
        colour=claim.colour,
        side=claim.side,
        distance=claim.distance,
        size=claim.size,
        graspable=False,
        accessible=False,
        confidence=min(claim.confidence, MOST_UNMEASURED),
        source=EvidenceSource.MODEL,
    )


def _relations(
    measured: Iterable[AnalysedRelation],
    claims: Iterable[ClaimedRelation],
    known: set[str | None],
) -> Iterator[AnalysedRelation]:
    """Yield claims about pairs of which nothing was measured."""
    settled = {frozenset({one.subject, one.other}) for one in measured}
    for one in claims:
        pair = frozenset({one.subject, one.other})
        if len(pair) == 2 and pair <= known and pair not in settled:
            yield AnalysedRelation(
                subject=one.subject,
                relation=one.relation,
                other=one.other,
                source=EvidenceSource.MODEL,
            )


def _task(measured: Task | None, claim: ClaimedTask | None) -> Task | None:
    """Add a model's doubts, and its opinion where nothing is measured; it overrules nothing."""
    if measured is None or claim is None:
        return measured
    said = {
        "obstacles": (*measured.obstacles, *map(_marked, claim.obstacles)),
        "alternatives": (*measured.alternatives, *map(_marked, claim.alternatives)),
        "prerequisites": (*measured.prerequisites, *map(_marked, claim.prerequisites)),
    }
    if measured.feasible is Feasible.UNKNOWN:
        opinion = f"it {'can' if claim.feasible else 'cannot'} be reached ({claim.confidence:.1f})"
        reason = f"{measured.reason}; {_marked(f'{opinion}: {claim.reason}')}"
        return measured.model_copy(update={**said, "reason": reason})
    if measured.feasible is not Feasible.NO and not claim.feasible:
        doubted = round(measured.confidence * DOUBT, _DIGITS)
        reason = f"{measured.reason}; {_marked('doubts it: ' + claim.reason)}"
        return measured.model_copy(update={**said, "confidence": doubted, "reason": reason})
    return measured.model_copy(update=said)


def _marked(text: str) -> str:
    """Mark what a model says and nothing has measured."""
    return f"model: {text}"
