"""Track things in the map frame: the same thing keeps its id from one image to the next.

A thing that appears keeps the id of one that has left its place, if class and colour are
the same, the size is similar, and a person could have carried it there in the time.
"""

import math
from collections import Counter
from collections.abc import Collection, Iterable, Mapping
from typing import Any

import numpy as np

from drivers.clock import NS_PER_S
from vla_deploy.perception.images.detection import Vector
from vla_deploy.perception.naming.classes import OTHER
from vla_deploy.perception.objects.matching import match
from vla_deploy.perception.objects.track import (
    Sighting,
    Track,
    attach_to_hand,
    gap_m,
    mark_dropped,
    new_track,
    restored_track,
    update_track,
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
SIZE_RATIO = 1.6
# A person in a hurry, and what two observations of one place may differ by.
CARRY_SPEED_M_S = 2.5
SLACK_M = 0.5
# One miss may be the detector's; after two in a row a thing is not where it was.
MISSING_MISSES = 2
# A bound on what a thing takes of the scene's cell: a client with an older id asks again.
ALIASES_KEPT = 3
GONE = "its place was seen without it"


class Tracker:
    """Match detections to things; confirm, remember and forget."""

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
        """Return every track, confirmed or not."""
        return list(self._tracks)

    @property
    def vanished(self) -> list[Track]:
        """Return what has left its place and was not found again, the oldest first."""
        return list(self._vanished)

    def update(self, sightings: list[Sighting], in_view: Collection[Track], stamp_ns: int) -> None:
        """Process one image's sightings; `in_view` are the tracks whose places it shows clearly."""
        pairs = match(self._tracks, sightings, stamp_ns)
        matched = {id(track) for track, _, _ in pairs}
        taken = {id(sighting) for _, sighting, _ in pairs}
        for track in in_view:
            if not track.held_by and id(track) not in matched:
                track.misses += 1
        for track, sighting, was_moved in pairs:
            update_track(track, sighting, stamp_ns, was_moved=was_moved)
        for sighting in sightings:
            if id(sighting) not in taken and _is_sure(sighting) and not self._is_part(sighting):
                self._tracks.append(new_track(sighting, stamp_ns))
        self._forget()
        self._merge_duplicates([track for track, _, _ in pairs])
        for track in list(self._tracks):
            if not track.object_id and _is_confirmed(track):
                self._identify(track)

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
            attach_to_hand(held, hand, grip_m, stamp_ns)
        return held

    def held_by(self, hand: str) -> Track | None:
        """Return the thing that a hand carries, or None."""
        return next((track for track in self._tracks if track.held_by == hand), None)

    def release(self, hand: str) -> None:
        """Release what a hand carries: the thing is near where the hand was."""
        held = self.held_by(hand)
        if held is not None:
            held.held_by = ""

    def lose(self, hand: str, cause: str) -> None:
        """Mark what a hand carries as lost: the thing is somewhere near."""
        held = self.held_by(hand)
        if held is not None:
            mark_dropped(held, cause)

    def restore(
        self, objects: Iterable[Mapping[str, Any]], lost: Iterable[Mapping[str, Any]] = ()
    ) -> None:
        """Restore the things of an earlier scene, as not in view now.

        Ids of those that are `lost` stay theirs: another thing must not be taken for them.
        """
        known = [restored_track(one) for one in objects]
        vanished = [restored_track(one) for one in lost]
        self._tracks.extend(known)
        self._vanished.extend(vanished)
        for track in (*known, *vanished):
            for name in (track.object_id, *track.aliases):
                kind, _, number = name.rpartition("_")
                self._used[kind] = max(self._used[kind], int(number))

    def _nearest(self, class_name: str, grip_m: Vector) -> Track | None:
        # What is only felt may be of any class, so it must be close to the grip.
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
            track.is_like(seen)
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
            if track.object_id and not self._hand_down(track):
                track.cause = track.cause or GONE
                self._vanished.append(track)
        del self._vanished[:-VANISHED_KEPT]
        while len(self._tracks) > MAX_TRACKS:
            self._tracks.remove(min(self._tracks, key=lambda one: one.last_seen_ns))

    def _hand_down(self, gone: Track) -> bool:
        """Give a thing's id to one that appeared elsewhere after it was last seen."""
        younger = [
            track
            for track in self._tracks
            if track.object_id
            and track.first_seen_ns > gone.last_seen_ns
            and may_be_same(gone, track)
        ]
        if younger:
            inherit_identity(min(younger, key=lambda one: gap_m(gone, one)), gone)
        return bool(younger)

    def _merge_duplicates(self, seen: list[Track]) -> None:
        """Merge unseen tracks into the ones seen now that are alike in the same place."""
        for track in seen:
            for other in [one for one in self._tracks if one not in seen]:
                apart_m = math.dist(other.position_m[:2], track.position_m[:2])
                alike = other.class_name == track.class_name and not other.held_by
                if alike and apart_m < 0.5 * min(track.size_m[:2]):
                    self._tracks.remove(other)
                    if other.object_id:
                        inherit_identity(track, other)

    def _identify(self, track: Track) -> None:
        """Give a track the id of the same kind of thing that has left its place, or a new one."""
        missing = [one for one in self._tracks if one.object_id and one.misses >= MISSING_MISSES]
        elder = nearest_candidate(self._vanished, track) or nearest_candidate(missing, track)
        if elder is not None:
            (self._vanished if elder in self._vanished else self._tracks).remove(elder)
            inherit_identity(track, elder)
            return
        self._used[track.class_name] += 1
        track.object_id = f"{track.class_name}_{self._used[track.class_name]}"


def _is_sure(sighting: Sighting) -> bool:
    """Return whether a sighting is good enough to begin a track with."""
    seen = sighting.detection
    return not (seen.truncated or (seen.occluded and seen.class_name == OTHER))


def _is_confirmed(track: Track) -> bool:
    """Return whether enough sightings agree on what a thing is."""
    return (
        track.seen_count >= CONFIRM_HITS and track.classes.share(track.class_name) > CONFIRM_SHARE
    )


def may_be_same(elder: Track, newer: Track) -> bool:
    """Return whether `newer` may be the thing that was known as `elder`, brought elsewhere."""
    if not elder.is_like(newer):
        return False
    sizes = [float(np.prod(np.maximum(one.size_m, 1e-3))) ** (1.0 / 3.0) for one in (elder, newer)]
    if max(sizes) > SIZE_RATIO * min(sizes):
        return False
    between_s = max(0.0, (newer.last_seen_ns - elder.last_seen_ns) / NS_PER_S)
    return gap_m(elder, newer) <= SLACK_M + CARRY_SPEED_M_S * between_s


def nearest_candidate(elders: Iterable[Track], newer: Track) -> Track | None:
    """Return the nearest thing that `newer` may be, or None."""
    able = [elder for elder in elders if may_be_same(elder, newer)]
    return min(able, key=lambda elder: gap_m(elder, newer), default=None)


def inherit_identity(newer: Track, elder: Track) -> None:
    """Give a thing the id and the history of the one that it turned out to be."""
    names = (newer.object_id, *newer.aliases, *elder.aliases)
    other = dict.fromkeys(name for name in names if name and name != elder.object_id)
    newer.aliases = tuple(other)[:ALIASES_KEPT]
    newer.object_id = elder.object_id
    newer.first_seen_ns = min(newer.first_seen_ns, elder.first_seen_ns)
