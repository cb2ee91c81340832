"""Type what perception reports of the world; docs/world-model.md says what it means."""

from typing import Any, Literal, NotRequired, TypedDict


class RestDocument(TypedDict):
    """Say on or in what a thing rests."""

    relation: str
    of: str


ThingDocument = TypedDict(
    "ThingDocument",
    {
        "id": str,
        "class": str,
        "colour": str,
        "position_m": list[float],
        "size_m": list[float],
        "yaw_rad": float,
        "last_seen_ns": int,
        "seen_count": int,
        "confidence": float,
        "sigma_m": list[float],
        "classes": dict[str, float],
        "colours": dict[str, float],
        "aliases": NotRequired[list[str]],
        "held_by": NotRequired[str],
        "rests": NotRequired[RestDocument],
        "cause": NotRequired[str],
    },
)
"""A thing, which keeps its id when it is moved.

`position_m` is the centre, x, y, z: a box's rim is half its height above. `size_m` has dx along
`yaw_rad`. While a hand holds the thing (told by the executor, confirmed by touch) the position is
the hand's. `cause` says why a lost thing is lost.
"""

BystanderDocument = TypedDict(
    "BystanderDocument",
    {
        "class": str,
        "position_m": list[float],
        "width_m": float,
        "top_m": float,
        "confidence": float,
    },
)
"""A person or a chair in the last image, at x, y; never to be taken."""

HandDocument = TypedDict(
    "HandDocument",
    {
        "holding": str | None,
        "class": str | None,
        "told": str | None,
        "felt": str,
        "confirmed": bool,
        "width_m": float | None,
        "drift_m": float,
        "effort_ratio": float,
        "cause": str,
    },
)
"""What a hand holds: the thing's id, its class, as the executor told and as the fingers feel."""


class SurfaceDocument(TypedDict):
    """Describe the part of a surface that is in view."""

    name: str
    height_m: float
    polygon_m: list[list[float]]


class SightDocument(TypedDict):
    """Say how things are named, why not by a network; `late` are answers, `model` statistics."""

    mode: Literal["network", "form"]
    why: str
    late: int
    model: dict[str, Any] | None


class ImageStatus(TypedDict):
    """Say what the last image is good for, and count those that were good for nothing."""

    use: str
    faults: list[str]
    refused: int


class RobotPlace(TypedDict):
    """Place the robot on the map."""

    x_m: float
    y_m: float
    yaw_rad: float


class KnownThings(TypedDict):
    """Hold what is known of the world."""

    stamp_ns: int
    objects: list[ThingDocument]
    surfaces: list[SurfaceDocument]
    bystanders: list[BystanderDocument]
    lost: list[ThingDocument]
    hands: dict[str, HandDocument]


class SceneDocument(KnownThings):
    """Hold also where the robot is, null while it is lost, how it sees, why sensors are away."""

    robot: RobotPlace | None
    sight: SightDocument
    image: ImageStatus
    away: dict[str, str]
