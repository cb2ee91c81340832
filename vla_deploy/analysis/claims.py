"""Define what a model may claim of a scene: the shape that is asked for, with bounded words."""

import re
from typing import Annotated, Final, Literal

from pydantic import AfterValidator, BaseModel, ConfigDict, Field

from vla_deploy.analysis.document import Distance, Side, SizeClass
from vla_deploy.feasibility.verdict import Ratio

MOST_OBJECTS: Final = 60
MOST_RELATIONS: Final = 120
MOST_SENTENCES: Final = 6
_NAME_CHARACTERS: Final = 40
_SENTENCE_CHARACTERS: Final = 160
_NOT_IN_NAMES: Final = re.compile(r"[^\w \-']+")


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
