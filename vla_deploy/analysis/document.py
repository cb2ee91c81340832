"""Define the analysis of a scene, as every analyser gives it: `docs/analysis.schema.json`."""

from enum import StrEnum
from typing import Any

from pydantic import BaseModel, ConfigDict

from vla_deploy.feasibility.verdict import Ratio, Task


class Side(StrEnum):
    """Say where a thing is as the robot faces."""

    LEFT = "left"
    CENTRE = "centre"
    RIGHT = "right"


class Distance(StrEnum):
    """Say how far a thing is: near within an arm's length and a step, far across the room."""

    NEAR = "near"
    MID = "mid"
    FAR = "far"


class SizeClass(StrEnum):
    """Say how large a thing is, by its longest side."""

    TINY = "tiny"
    SMALL = "small"
    MEDIUM = "medium"
    LARGE = "large"


class EvidenceSource(StrEnum):
    """Say who vouches: the robot's own measurement, a model that was asked, or both."""

    GEOMETRY = "geometry"
    MODEL = "model"
    BOTH = "both"


class _Value(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class AnalysedObject(_Value):
    """Describe one thing; without an `id` the robot has not measured it, and cannot take it."""

    id: str | None
    name: str
    colour: str
    side: Side | None
    distance: Distance | None
    size: SizeClass | None
    graspable: bool
    accessible: bool
    confidence: Ratio
    source: EvidenceSource


class AnalysedRelation(_Value):
    """Say that `subject` stands in a relation to `other`: ids of things, or names of surfaces."""

    subject: str
    relation: str
    other: str
    source: EvidenceSource = EvidenceSource.GEOMETRY


class SceneAnalysis(_Value):
    """Hold what an analyser makes of the scene at `stamp_ns`; `notes` say what fell short."""

    stamp_ns: int
    analyser: str
    objects: tuple[AnalysedObject, ...]
    relations: tuple[AnalysedRelation, ...]
    task: Task | None = None
    notes: tuple[str, ...] = ()


def analysis_schema() -> dict[str, Any]:
    """Return the JSON Schema of an analysis, as published in `docs/analysis.schema.json`."""
    return SceneAnalysis.model_json_schema()
