"""Remember things in the map frame: same thing, same id, from one image to the next."""

import math
from collections import Counter
from collections.abc import Iterable, Mapping
from typing import Any

from vla_deploy.perception.images.detection import Vector
from vla_deploy.perception.naming.classes import OTHER
from vla_deploy.perception.objects.identity import is_missing, likeliest, may_be, take_over
from vla_deploy.perception.objects.in_view import PlaceView
from vla_deploy.perception.objects.matching import match
from vla_deploy.perception.objects.track import (
    Sighting,
    Track,
    absorb,
    gap_m,
    let_fall,
    new_track,
    recalled,
    take_in_hand,
)

CONFIRM_HITS = 2
CONFIRM_SHARE = 0.5
CARRY_GATE_M = 0.2
FELT_GATE_M = 0.06
MISSES_TO_FORGET = 5
UNCONFIRMED_MISSES = 2
MAX_OBJECTS = 64
MAX_TRACKS = 128
VANISHED_KEPT = 32
GONE = "its place was seen without it"


class Tracker:
    """Match sights to things; confirm, remember and forget."""

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

    @property
    def vanished(self) -> list[Track]:
        """Return what is no longer where it was and has not been found again, the oldest first."""
        return list(self._vanished)

    def update(self, sightings: list[Sighting], views: dict[int, PlaceView], stamp_ns: int) -> None:
        """Take one image's sights; `views` maps `id(track)` to what is seen at its place."""
        pairs = match(self._tracks, sightings, stamp_ns)
        matched = {id(track) for track, _, _ in pairs}
        taken = {id(sighting) for _, sighting, _ in pairs}
        for track in self._tracks:
            is_clear = views.get(id(track)) is PlaceView.CLEAR and not track.held_by
            if is_clear and id(track) not in matched:
                track.misses += 1
        for track, sighting, was_moved in pairs:
            absorb(track, sighting, stamp_ns, was_moved=was_moved)
        for sighting in sightings:
            if id(sighting) not in taken and _is_sure(sighting) and not self._is_part(sighting):
                self._tracks.append(new_track(sighting, stamp_ns))
        self._forget()
        self._drop_doubles([track for track, _, _ in pairs])
        for track in list(self._tracks):
            if not track.object_id and _is_believed(track):
                self._name(track)

    def carry(self, hand: str, class_name: str, grip_m: Vector, stamp_ns: int) -> Track | None:
        """Move the thing that a hand holds along with the hand; return it, None for none known.

        The first call takes the nearest thing of the class within reach of the grip, later ones
        stay with it.
        """
        held = self.held_by(hand)
        if held is None or class_name not in (held.class_name, OTHER):
            self.release(hand)
            held = self._nearest(class_name, grip_m)
        if held is not None:
            take_in_hand(held, hand, grip_m, stamp_ns)
        return held

    def held_by(self, hand: str) -> Track | None:
        """Return the thing that a hand carries, or None."""
        return next((track for track in self._tracks if track.held_by == hand), None)

    def release(self, hand: str) -> None:
        """Take note that a hand has let go: the thing is near where the hand was."""
        held = self.held_by(hand)
        if held is not None:
            held.held_by = ""

    def lose(self, hand: str, cause: str) -> None:
        """Take note that a hand has lost what it carried: the thing is somewhere near."""
        held = self.held_by(hand)
        if held is not None:
            let_fall(held, cause)

    def recall(
        self, told: Iterable[Mapping[str, Any]], lost: Iterable[Mapping[str, Any]] = ()
    ) -> None:
        """Take over the things of a scene that was told before, as not in view now.

        Ids of those that are `lost` stay theirs: another thing must not be taken for them.
        """
        known, vanished = [recalled(one) for one in told], [recalled(one) for one in lost]
        self._tracks.extend(known)
        self._vanished.extend(vanished)
        for track in (*known, *vanished):
            for name in (track.object_id, *track.aliases):
                kind, _, number = name.rpartition("_")
                self._used[kind] = max(self._used[kind], int(number))

    def _nearest(self, class_name: str, grip_m: Vector) -> Track | None:
        # What is felt and not told of may be anything: only what is right there is meant.
        gate_m = CARRY_GATE_M if class_name != OTHER else FELT_GATE_M
        near = [
            (distance_m, track.object_id, track)
            for track in self._tracks
            if track.object_id
            and not track.held_by
            and class_name in (track.class_name, OTHER)
            and (distance_m := math.dist(track.position_m, grip_m)) < gate_m
        ]
        return min(near)[2] if near else None

    def _is_part(self, sighting: Sighting) -> bool:
        """Return whether this is a half-hidden part of a known thing, seen a second time."""
        seen = sighting.detection
        return seen.occluded and any(
            (track.class_name, track.colour) == (seen.class_name, seen.colour)
            and math.dist(track.position_m, seen.position_m) < 0.5 * max(track.size_m)
            for track in self._tracks
        )

    def _forget(self) -> None:
        """Drop what has left its place; a younger thing that it may have become takes its id."""
        gone = [
            track
            for track in self._tracks
            if track.misses >= (MISSES_TO_FORGET if track.object_id else UNCONFIRMED_MISSES)
        ]
        for track in gone:
            self._tracks.remove(track)
        for track in gone:
            if track.object_id and not self._live_on(track):
                track.cause = track.cause or GONE
                self._vanished.append(track)
        del self._vanished[:-VANISHED_KEPT]
        while len(self._tracks) > MAX_TRACKS:
            self._tracks.remove(min(self._tracks, key=lambda one: one.last_seen_ns))

    def _live_on(self, gone: Track) -> bool:
        """Give a thing's id to one that appeared elsewhere after it was last seen."""
        younger = [
            track
            for track in self._tracks
            if track.object_id and track.first_seen_ns > gone.last_seen_ns and may_be(gone, track)
        ]
        if not younger:
            return False
        take_over(min(younger, key=lambda one: gap_m(gone, one)), gone)
        return True

    def _drop_doubles(self, seen: list[Track]) -> None:
        """Let what is seen now take over the id of an unseen thing like it in the same place."""
        for track in seen:
            for other in [one for one in self._tracks if one not in seen]:
                apart_m = math.dist(other.position_m[:2], track.position_m[:2])
                alike = other.class_name == track.class_name and not other.held_by
                if alike and apart_m < 0.5 * min(track.size_m[:2]):
                    self._tracks.remove(other)
                    if other.object_id:
                        take_over(track, other)

    def _name(self, track: Track) -> None:
        """Give a track the id of the same kind of thing that has left its place, or a new one."""
        missing = [one for one in self._tracks if is_missing(one)]
        elder = likeliest(self._vanished, track) or likeliest(missing, track)
        if elder is not None:
            (self._vanished if elder in self._vanished else self._tracks).remove(elder)
            take_over(track, elder)
            return
        self._used[track.class_name] += 1
        track.object_id = f"{track.class_name}_{self._used[track.class_name]}"


def _is_sure(sighting: Sighting) -> bool:
    """Return whether a sight is good enough to begin a track with."""
    seen = sighting.detection
    return not (seen.truncated or (seen.occluded and seen.class_name == OTHER))


def _is_believed(track: Track) -> bool:
    """Return whether enough looks agree on what a thing is."""
    return (
        track.seen_count >= CONFIRM_HITS and track.classes.share(track.class_name) > CONFIRM_SHARE
    )
