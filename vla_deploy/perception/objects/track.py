"""Hold what is known of one thing, and take in one more sight of it."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any

import numpy as np

from vla_deploy.perception.geometry.shapes import half_turn
from vla_deploy.perception.images.detection import Detection, Vector
from vla_deploy.perception.naming.class_fusion import Belief
from vla_deploy.perception.naming.classes import OTHER
from vla_deploy.perception.objects.filtering import Estimate, carried, corrected, dropped
from vla_deploy.world.thing import Rest, Thing

LEAST_GAIN = 0.2
DOUBTFUL_GAIN = 0.05
# Half-hidden sights in a row are wrong in the same way: so many of them count as one.
DOUBTFUL_LOOKS = 9.0
KNOWN_LOOKS = 5
ODD_SIZE_RATIO = 1.5
MOST_ODD_SIGHTS = 8
"""Nothing changes its size: what was seen `KNOWN_LOOKS` times and is told so much larger or smaller
was cut out of the image with what stands beside it, unless more sights than these in a row say so.
"""
# Not to recognise a thing says little against one that knew it.
CLASS_WEIGHTS: Mapping[str, float] = MappingProxyType({OTHER: 0.25})
TOLD_NAMES = 3


@dataclass(frozen=True, slots=True)
class Sighting:
    """Hold one image's detection in the map frame, and where its thing is by this sight alone."""

    detection: Detection
    seen: Estimate

    @property
    def is_doubtful(self) -> bool:
        """Return whether a part of the thing is hidden, so that class and size are guesses."""
        return self.detection.truncated or self.detection.occluded


def _no_class() -> Belief:
    return Belief(OTHER, CLASS_WEIGHTS)


def _no_colour() -> Belief:
    return Belief("grey")


@dataclass(slots=True, eq=False, kw_only=True)
class Track:
    """Hold one thing; `object_id` is empty until it is confirmed, `held_by` names a hand.

    `aliases` are the last ids under which the same thing was known before it was found to be the
    same; `cause` tells why it is no longer where it was; `odd_sights` counts the last sights in a
    row that told quite another size.
    """

    estimate: Estimate
    size_m: Vector
    yaw_rad: float
    confidence: float
    first_seen_ns: int
    last_seen_ns: int
    seen_count: int = 0
    misses: int = 0
    odd_sights: int = 0
    object_id: str = ""
    aliases: tuple[str, ...] = ()
    held_by: str = ""
    rests: Rest | None = None
    cause: str = ""
    classes: Belief = field(default_factory=_no_class)
    colours: Belief = field(default_factory=_no_colour)

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

    @property
    def thing(self) -> Thing:
        """Return the thing as the world model takes it."""
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

    def document(self) -> dict[str, Any]:
        """Return the thing as the scene topic tells it."""
        told: dict[str, Any] = {
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
            "classes": _rounded(self.classes.shares(TOLD_NAMES)),
            "colours": _rounded(self.colours.shares(TOLD_NAMES)),
        }
        if self.aliases:
            told["aliases"] = list(self.aliases)
        if self.held_by:
            told["held_by"] = self.held_by
        if self.rests is not None:
            told["rests"] = {"relation": self.rests.relation, "of": self.rests.of}
        if self.cause:
            told["cause"] = self.cause
        return told


def new_track(sighting: Sighting, stamp_ns: int) -> Track:
    """Return the track that a sight begins."""
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


def absorb(track: Track, sighting: Sighting, stamp_ns: int, *, was_moved: bool) -> None:
    """Take in a sight; of what `was_moved` the old place says nothing."""
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
        track.estimate = corrected(track.estimate, sighting.seen, looks)
    if detection.class_name == track.class_name:
        # What is taken for another kind was cut out of the image in another way.
        _take_form(track, detection, gain)


def _take_form(track: Track, detection: Detection, gain: float) -> None:
    """Move size, yaw and confidence towards those of a sight, unless it is an odd one."""
    small_m, large_m = sorted(math.hypot(*one.size_m[:2]) for one in (track, detection))
    is_odd = track.seen_count > KNOWN_LOOKS and large_m > ODD_SIZE_RATIO * small_m
    track.odd_sights = track.odd_sights + 1 if is_odd else 0
    if 0 < track.odd_sights <= MOST_ODD_SIGHTS:
        return
    track.size_m = _blend(track.size_m, detection.size_m, gain)
    turn_rad = half_turn(detection.yaw_rad - track.yaw_rad)
    track.yaw_rad = half_turn(track.yaw_rad + gain * turn_rad)
    track.confidence += gain * (detection.confidence - track.confidence)


def take_in_hand(track: Track, hand: str, grip_m: Vector, stamp_ns: int) -> None:
    """Seat a thing where the hand is that holds it."""
    track.estimate = carried(grip_m, stamp_ns)
    track.held_by, track.last_seen_ns, track.misses = hand, stamp_ns, 0
    track.rests, track.cause = None, ""


def let_fall(track: Track, cause: str) -> None:
    """Seat a thing that a hand has lost: somewhere near and below it."""
    track.estimate = dropped(track.estimate)
    track.held_by, track.rests, track.cause = "", None, cause


def recalled(told: Mapping[str, Any]) -> Track:
    """Return the track that the scene topic's object tells of."""
    x_m, y_m, z_m = (float(value) for value in told["size_m"])
    stamp_ns, looks = int(told["last_seen_ns"]), int(told["seen_count"])
    track = Track(
        estimate=Estimate(
            position_m=np.array(told["position_m"], dtype=np.float64),
            covariance_m2=np.diag(np.square(np.array(told["sigma_m"], dtype=np.float64))),
            stamp_ns=stamp_ns,
        ),
        size_m=(x_m, y_m, z_m),
        yaw_rad=float(told["yaw_rad"]),
        # What is told is the confidence in the sights times that in the class.
        confidence=float(told["confidence"]) / max(told["classes"].values()),
        first_seen_ns=stamp_ns,
        last_seen_ns=stamp_ns,
        seen_count=looks,
        object_id=str(told["id"]),
        aliases=tuple(told.get("aliases", ())),
        rests=Rest(**told["rests"]) if "rests" in told else None,
        cause=str(told.get("cause", "")),
    )
    track.classes.recall(told["classes"], looks)
    track.colours.recall(told["colours"], looks)
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
