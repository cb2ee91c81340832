"""Hold what is known of one thing, and update it with each observation."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any

import numpy as np

from vla_deploy.ipc.payloads.scene import ThingDocument
from vla_deploy.perception.geometry.shapes import half_turn
from vla_deploy.perception.images.detection import Detection, Vector
from vla_deploy.perception.naming.class_fusion import NameEvidence
from vla_deploy.perception.naming.classes import OTHER
from vla_deploy.perception.objects.filtering import Estimate, carried, dropped, updated
from vla_deploy.world.document import read_thing
from vla_deploy.world.thing import Rest, Thing

LEAST_GAIN = 0.2
DOUBTFUL_GAIN = 0.05
# Half-hidden observations in a row have the same error: so many of them count as one.
DOUBTFUL_LOOKS = 9.0
KNOWN_LOOKS = 5
ODD_SIZE_RATIO = 1.5
MAX_ODD_SIGHTINGS = 8
"""Nothing changes its size: what was seen `KNOWN_LOOKS` times and appears so much larger or smaller
was segmented together with its neighbour, unless more than these in a row agree.
"""
# Not recognising a thing is weak evidence.
CLASS_WEIGHTS: Mapping[str, float] = MappingProxyType({OTHER: 0.25})
PUBLISHED_NAMES = 3


@dataclass(frozen=True, slots=True)
class Sighting:
    """Hold one image's detection in the map frame, and the position estimate by it alone."""

    detection: Detection
    seen: Estimate

    @property
    def is_doubtful(self) -> bool:
        """Return whether a part of the thing is hidden, so that class and size are guesses."""
        return self.detection.truncated or self.detection.occluded


def _no_class() -> NameEvidence:
    return NameEvidence(OTHER, CLASS_WEIGHTS)


def _no_colour() -> NameEvidence:
    return NameEvidence("grey")


@dataclass(slots=True, eq=False, kw_only=True)
class Track:
    """Hold one thing; `object_id` is empty until it is confirmed, `held_by` names a hand.

    `aliases` are the last ids that were found to be of the same thing; `cause` is why it is no
    longer where it was; `odd_sightings` counts the last ones in a row of quite another size.
    """

    estimate: Estimate
    size_m: Vector
    yaw_rad: float
    confidence: float
    first_seen_ns: int
    last_seen_ns: int
    seen_count: int = 0
    misses: int = 0
    odd_sightings: int = 0
    object_id: str = ""
    aliases: tuple[str, ...] = ()
    held_by: str = ""
    rests: Rest | None = None
    cause: str = ""
    classes: NameEvidence = field(default_factory=_no_class)
    colours: NameEvidence = field(default_factory=_no_colour)

    @property
    def position_m(self) -> Vector:
        """Return the place of its centre in the map frame."""
        x_m, y_m, z_m = (float(value) for value in self.estimate.position_m)
        return (x_m, y_m, z_m)

    @property
    def class_name(self) -> str:
        """Return the likeliest class."""
        return self.classes.best

    @property
    def colour(self) -> str:
        """Return the likeliest colour."""
        return self.colours.best

    def is_like(self, other: "Track | Detection") -> bool:
        """Return whether something has the same class and colour."""
        return (self.class_name, self.colour) == (other.class_name, other.colour)

    @property
    def thing(self) -> Thing:
        """Return the thing for the world model."""
        x_m, y_m, z_m = (float(value) for value in self.estimate.sigma_m)
        return Thing(
            thing_id=self.object_id,
            kind=self.class_name,
            colour=self.colour,
            position_m=self.position_m,
            size_m=self.size_m,
            yaw_rad=self.yaw_rad,
            last_seen_ns=self.last_seen_ns,
            confidence=self.confidence,
            sigma_m=(x_m, y_m, z_m),
            rests=self.rests,
            held_by=self.held_by,
            aliases=self.aliases,
        )

    def document(self) -> ThingDocument:
        """Return the thing for the scene topic."""
        document: ThingDocument = {
            "id": self.object_id,
            "class": self.class_name,
            "colour": self.colour,
            "position_m": [round(v, 4) for v in self.position_m],
            "size_m": [round(v, 4) for v in self.size_m],
            "yaw_rad": round(self.yaw_rad, 4),
            "last_seen_ns": self.last_seen_ns,
            "seen_count": self.seen_count,
            "confidence": round(self.confidence * self.classes.share(self.class_name), 3),
            "sigma_m": [round(float(v), 4) for v in self.estimate.sigma_m],
            "classes": _rounded(self.classes.shares(PUBLISHED_NAMES)),
            "colours": _rounded(self.colours.shares(PUBLISHED_NAMES)),
        }
        if self.aliases:
            document["aliases"] = list(self.aliases)
        if self.held_by:
            document["held_by"] = self.held_by
        if self.rests is not None:
            document["rests"] = {"relation": self.rests.relation, "of": self.rests.of}
        if self.cause:
            document["cause"] = self.cause
        return document


def new_track(sighting: Sighting, stamp_ns: int) -> Track:
    """Return the track that an observation begins."""
    detection = sighting.detection
    track = Track(
        estimate=sighting.seen,
        size_m=detection.size_m,
        yaw_rad=detection.yaw_rad,
        confidence=detection.confidence,
        first_seen_ns=stamp_ns,
        last_seen_ns=stamp_ns,
        seen_count=1,
    )
    _vote(track, detection)
    return track


def update_track(track: Track, sighting: Sighting, stamp_ns: int, *, was_moved: bool) -> None:
    """Update with an observation; where the thing `was_moved`, its old place says nothing."""
    detection = sighting.detection
    track.misses, track.cause = 0, ""
    track.last_seen_ns = stamp_ns
    track.seen_count += 1
    gain = DOUBTFUL_GAIN if sighting.is_doubtful else max(LEAST_GAIN, 1.0 / track.seen_count)
    if not sighting.is_doubtful:
        _vote(track, detection)
    if was_moved:
        gain, track.estimate = 1.0, sighting.seen
    else:
        looks = DOUBTFUL_LOOKS if sighting.is_doubtful else 1.0
        track.estimate = updated(track.estimate, sighting.seen, looks)
    if detection.class_name == track.class_name:
        # What looks like another kind was segmented in another way.
        _update_form(track, detection, gain)


def _update_form(track: Track, detection: Detection, gain: float) -> None:
    """Move size, yaw and confidence towards a detection's, unless its size is an odd one."""
    small_m, large_m = sorted(math.hypot(*one.size_m[:2]) for one in (track, detection))
    is_odd = track.seen_count > KNOWN_LOOKS and large_m > ODD_SIZE_RATIO * small_m
    track.odd_sightings = track.odd_sightings + 1 if is_odd else 0
    if 0 < track.odd_sightings <= MAX_ODD_SIGHTINGS:
        return
    track.size_m = _blend(track.size_m, detection.size_m, gain)
    turn_rad = half_turn(detection.yaw_rad - track.yaw_rad)
    track.yaw_rad = half_turn(track.yaw_rad + gain * turn_rad)
    track.confidence += gain * (detection.confidence - track.confidence)


def attach_to_hand(track: Track, hand: str, grip_m: Vector, stamp_ns: int) -> None:
    """Place a thing at the hand that holds it."""
    track.estimate = carried(grip_m, stamp_ns)
    track.held_by, track.last_seen_ns, track.misses = hand, stamp_ns, 0
    track.rests, track.cause = None, ""


def mark_dropped(track: Track, cause: str) -> None:
    """Place a thing that a hand has lost: somewhere near and below it."""
    track.estimate = dropped(track.estimate)
    track.held_by, track.rests, track.cause = "", None, cause


def restored_track(document: Mapping[str, Any]) -> Track:
    """Return the track of an object of the scene topic."""
    thing, looks = read_thing(document), int(document["seen_count"])
    track = Track(
        estimate=Estimate(
            position_m=np.array(thing.position_m),
            covariance_m2=np.diag(np.square(thing.sigma_m)),
            stamp_ns=thing.last_seen_ns,
        ),
        size_m=thing.size_m,
        yaw_rad=thing.yaw_rad,
        # The published confidence is that in the observations times that in the class.
        confidence=thing.confidence / max(document["classes"].values()),
        first_seen_ns=thing.last_seen_ns,
        last_seen_ns=thing.last_seen_ns,
        seen_count=looks,
        object_id=thing.thing_id,
        aliases=thing.aliases,
        rests=thing.rests,
        cause=str(document.get("cause", "")),
    )
    track.classes.restore(document["classes"], looks)
    track.colours.restore(document["colours"], looks)
    return track


def gap_m(one: Track, other: Track) -> float:
    """Return the distance between two things' centres."""
    return math.dist(one.position_m, other.position_m)


def _vote(track: Track, detection: Detection) -> None:
    track.classes.add(detection.class_name)
    track.colours.add(detection.colour)


def _blend(old: Vector, new: Vector, gain: float) -> Vector:
    x, y, z = (a + gain * (b - a) for a, b in zip(old, new, strict=True))
    return (x, y, z)


def _rounded(shares: Mapping[str, float]) -> dict[str, float]:
    return {name: round(share, 3) for name, share in shares.items()}
