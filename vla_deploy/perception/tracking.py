"""Remember things in the map frame: same thing, same id, from one image to the next."""

import math
from collections import Counter
from dataclasses import dataclass, field
from enum import Enum
from typing import Any

from vla_deploy.perception.classes import OTHER
from vla_deploy.perception.detection import Detection, Vector
from vla_deploy.perception.shapes import half_turn

CONFIRM_HITS = 2
# Something of the same class and colour may have been pushed; anything else must be right there.
SAME_GATE_M = 0.12
OTHER_GATE_M = 0.05
CARRY_GATE_M = 0.2
LEAST_GAIN = 0.2
DOUBTFUL_GAIN = 0.05
UNKNOWN_WEIGHT = 0.25
MISSES_TO_FORGET = 5
UNCONFIRMED_MISSES = 2
MAX_OBJECTS = 64
VANISHED_KEPT = 32


class View(Enum):
    """Say what the image shows at the place of a remembered thing."""

    CLEAR = "its place is in clear view"
    HIDDEN = "out of the image, too far, or something is in front"


@dataclass(slots=True, eq=False)
class Track:
    """Hold what is known of one thing; `object_id` is empty until it is confirmed."""

    position_m: Vector
    size_m: Vector
    yaw_rad: float
    confidence: float
    last_seen_ns: int
    seen_count: int = 0
    misses: int = 0
    object_id: str = ""
    classes: Counter[str] = field(default_factory=Counter)
    colours: Counter[str] = field(default_factory=Counter)

    @property
    def class_name(self) -> str:
        """Return the class most often seen; not to recognise a thing says little against one."""
        votes = self._votes()
        return max(votes, key=lambda name: votes[name]) if votes else OTHER

    @property
    def certainty(self) -> float:
        """Return the share of sights that agree on the class."""
        votes = self._votes()
        return votes[self.class_name] / sum(votes.values()) if votes else 0.0

    def _votes(self) -> dict[str, float]:
        return {
            name: count * (UNKNOWN_WEIGHT if name == OTHER else 1.0)
            for name, count in self.classes.items()
        }

    @property
    def colour(self) -> str:
        """Return the colour most often seen."""
        return self.colours.most_common(1)[0][0] if self.colours else "grey"

    def document(self) -> dict[str, Any]:
        """Return the thing as the scene topic tells it."""
        return {
            "id": self.object_id,
            "class": self.class_name,
            "colour": self.colour,
            "position_m": [round(v, 4) for v in self.position_m],
            "size_m": [round(v, 4) for v in self.size_m],
            "yaw_rad": round(self.yaw_rad, 4),
            "last_seen_ns": self.last_seen_ns,
            "seen_count": self.seen_count,
            "confidence": round(self.confidence * self.certainty, 3),
        }


class Tracker:
    """Match detections (map frame) to tracks; confirm, remember and forget."""

    def __init__(self) -> None:
        self._tracks: list[Track] = []
        self._vanished: list[Track] = []
        self._used: Counter[str] = Counter()

    @property
    def objects(self) -> list[Track]:
        """Return the confirmed things, the most recently seen first."""
        confirmed = [track for track in self._tracks if track.object_id]
        return sorted(confirmed, key=lambda t: (-t.last_seen_ns, t.object_id))[:MAX_OBJECTS]

    @property
    def tracks(self) -> list[Track]:
        """Return every track, confirmed or not: their places are what `views` judges."""
        return list(self._tracks)

    def update(self, detections: list[Detection], views: dict[int, View], stamp_ns: int) -> None:
        """Take one image's detections; `views` maps `id(track)` to what is seen at its place."""
        pairs = self._match(detections)
        matched = {id(track) for track, _ in pairs}
        taken = {id(detection) for _, detection in pairs}
        for track in self._tracks:
            if id(track) not in matched and views.get(id(track)) is View.CLEAR:
                track.misses += 1
        for track, detection in pairs:
            _absorb(track, detection, stamp_ns)
        for detection in detections:
            if id(detection) not in taken and _is_sure(detection) and not self._is_part(detection):
                self._tracks.append(_new_track(detection, stamp_ns))
        self._forget()
        self._drop_doubles([track for track, _ in pairs])
        for track in self._tracks:
            if not track.object_id and track.seen_count >= CONFIRM_HITS:
                track.object_id = self._name(track)

    def carry(self, class_name: str, grip_m: Vector, stamp_ns: int) -> None:
        """Move the thing that a hand holds along with the hand: it is not where it was seen."""
        near = [
            (gap_m, track.object_id, track)
            for track in self._tracks
            if track.object_id
            and track.class_name == class_name
            and (gap_m := math.dist(track.position_m, grip_m)) < CARRY_GATE_M
        ]
        if near:
            _, _, held = min(near)
            held.position_m, held.last_seen_ns, held.misses = grip_m, stamp_ns, 0

    def _match(self, detections: list[Detection]) -> list[tuple[Track, Detection]]:
        """Pair each track with at most one detection, the closest pairs first."""
        candidates = [
            (distance_m, i, j)
            for i, track in enumerate(self._tracks)
            for j, detection in enumerate(detections)
            if (distance_m := _distance(track, detection)) is not None
        ]
        pairs, used_tracks, used_detections = [], set(), set()
        for _, i, j in sorted(candidates):
            if i not in used_tracks and j not in used_detections:
                used_tracks.add(i)
                used_detections.add(j)
                pairs.append((self._tracks[i], detections[j]))
        return pairs

    def _is_part(self, detection: Detection) -> bool:
        """Tell whether this is a half-hidden part of a known thing, seen a second time."""
        return detection.occluded and any(
            (track.class_name, track.colour) == (detection.class_name, detection.colour)
            and math.dist(track.position_m, detection.position_m) < 0.5 * max(track.size_m)
            for track in self._tracks
        )

    def _forget(self) -> None:
        gone = [
            track
            for track in self._tracks
            if track.misses >= (MISSES_TO_FORGET if track.object_id else UNCONFIRMED_MISSES)
        ]
        for track in gone:
            self._tracks.remove(track)
        self._vanished += [track for track in gone if track.object_id]
        del self._vanished[:-VANISHED_KEPT]

    def _drop_doubles(self, seen: list[Track]) -> None:
        """Let what is seen now take over the id of an unseen thing like it in the same place."""
        for track in seen:
            for other in [one for one in self._tracks if one not in seen]:
                gap_m = math.dist(other.position_m[:2], track.position_m[:2])
                alike = other.class_name == track.class_name
                if alike and gap_m < 0.5 * min(track.size_m[:2]):
                    self._tracks.remove(other)
                    track.object_id = other.object_id or track.object_id

    def _name(self, track: Track) -> str:
        """Return the id of the same kind of thing that has left its place, or a new id."""
        kind = (track.class_name, track.colour)
        missing = [t for t in self._tracks if t.object_id and t.misses > 0]
        for pool in (self._vanished, missing):
            for old in reversed(pool):
                if (old.class_name, old.colour) == kind:
                    if pool is self._vanished:
                        pool.remove(old)
                    else:
                        self._tracks.remove(old)
                    return old.object_id
        self._used[track.class_name] += 1
        return f"{track.class_name}_{self._used[track.class_name]}"


def _is_sure(detection: Detection) -> bool:
    """Tell whether a sight is good enough to begin a track with."""
    vague = detection.occluded and detection.class_name == OTHER
    return not (detection.truncated or vague)


def _distance(track: Track, detection: Detection) -> float | None:
    """Return how far apart they are, or None where they cannot be the same thing."""
    distance_m = math.dist(track.position_m, detection.position_m)
    doubtful = detection.truncated or detection.occluded
    alike = detection.class_name == track.class_name and detection.colour == track.colour
    reach_m = 0.5 * max(track.size_m[:2]) if doubtful else 0.0
    gate_m = max(SAME_GATE_M if alike or doubtful else OTHER_GATE_M, reach_m)
    return distance_m if distance_m < gate_m else None


def _new_track(detection: Detection, stamp_ns: int) -> Track:
    track = Track(
        position_m=detection.position_m,
        size_m=detection.size_m,
        yaw_rad=detection.yaw_rad,
        confidence=detection.confidence,
        last_seen_ns=stamp_ns,
    )
    _vote(track, detection)
    track.seen_count = 1
    return track


def _absorb(track: Track, detection: Detection, stamp_ns: int) -> None:
    track.misses = 0
    track.last_seen_ns = stamp_ns
    track.seen_count += 1
    doubtful = detection.truncated or detection.occluded
    gain = DOUBTFUL_GAIN if doubtful else max(LEAST_GAIN, 1.0 / track.seen_count)
    if not doubtful:
        _vote(track, detection)
        if math.dist(track.position_m, detection.position_m) > OTHER_GATE_M:
            gain = 1.0  # it was moved: its old place says nothing
    track.position_m = _blend(track.position_m, detection.position_m, gain)
    track.size_m = _blend(track.size_m, detection.size_m, gain)
    track.yaw_rad = half_turn(track.yaw_rad + gain * half_turn(detection.yaw_rad - track.yaw_rad))
    if detection.class_name == track.class_name:
        track.confidence += gain * (detection.confidence - track.confidence)


def _vote(track: Track, detection: Detection) -> None:
    track.classes[detection.class_name] += 1
    track.colours[detection.colour] += 1


def _blend(old: Vector, new: Vector, gain: float) -> Vector:
    x, y, z = (a + gain * (b - a) for a, b in zip(old, new, strict=True))
    return (x, y, z)
