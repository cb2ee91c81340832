"""Maintain the scene: the detections of each image, moved to the map frame, tracked over time."""

import itertools
import json
import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from vla_deploy.ipc.payloads.scene import HandDocument, KnownThings, SurfaceDocument, ThingDocument
from vla_deploy.navigation.pose import Pose2D
from vla_deploy.perception.geometry.cloud import PosedImage, make_cloud
from vla_deploy.perception.geometry.shapes import half_turn
from vla_deploy.perception.geometry.supports import (
    KnownSurface,
    Support,
    counter_clockwise,
    find_supports,
)
from vla_deploy.perception.geometry.uncertainty import turned
from vla_deploy.perception.images.detection import Detection, Vector, detect
from vla_deploy.perception.images.network_view import NetworkView
from vla_deploy.perception.objects.bystanders import Bystander, find_bystanders
from vla_deploy.perception.objects.filtering import Estimate, covariance_of
from vla_deploy.perception.objects.hands import Hold
from vla_deploy.perception.objects.in_view import is_in_clear_view
from vla_deploy.perception.objects.track import Sighting, Track
from vla_deploy.perception.objects.tracker import Tracker
from vla_deploy.world.document import read_snapshot
from vla_deploy.world.resting import BEGIN, LET_GO, RelationBounds, rest_of
from vla_deploy.world.surfaces import Point, SurfaceBook
from vla_deploy.world.thing import Rest, Surface

# The share of the scene's cell that is for things, the most recently seen first.
THINGS_BYTES = 25_000
MAX_LOST = 12


class Scene:
    """Hold the known things around the robot; `furniture` names points of the home's surfaces."""

    def __init__(self, furniture: Mapping[str, Point] | None = None) -> None:
        self._tracker = Tracker()
        self._book = SurfaceBook(furniture)
        self.stamp_ns = 0
        self._surfaces: list[SurfaceDocument] = []
        self._bystanders: list[Bystander] = []
        self._hands: dict[str, HandDocument] = {}

    def restore(self, document: Mapping[str, Any]) -> None:
        """Restore what an earlier instance in this run knew, as not in view now.

        Raises:
            SceneUnreadable: the document is no scene.
        """
        read_snapshot(document)
        self._tracker.restore(document["objects"], document.get("lost", ()))

    def update(self, image: PosedImage, network: NetworkView | None) -> None:
        """Process an image; `network` is what the detector found in it, if one is at work."""
        base, stamp_ns = image.base, image.stamp_ns
        cloud = make_cloud(
            image.rgb,
            image.depth_m,
            image.camera,
            image.base_from_camera,
            image.body,
            image.aim_sigma_rad,
        )
        supports = find_supports(cloud, [_known(one, base) for one in self._book.surfaces])
        self._surfaces = [self._surface(one, base) for one in supports if not one.is_floor]
        found = detect(cloud, supports, network)
        sightings = [_sighting(detection, base, stamp_ns) for detection in found]
        self._bystanders = find_bystanders(cloud, network, base)
        in_view = [
            track
            for track in self._tracker.tracks
            if is_in_clear_view(_local(track, base), track.size_m, cloud, found)
        ]
        self._tracker.update(sightings, in_view, stamp_ns)
        self.stamp_ns = stamp_ns
        for track in self._tracker.objects:
            if track.last_seen_ns == stamp_ns and not track.held_by:
                track.rests = self._rest_of(track, BEGIN)

    def hold(self, hand: str, hold: Hold, grip: Vector, base: Pose2D, stamp_ns: int) -> None:
        """Record what a hand holds; `grip` is where the hand is, in the base frame.

        What it has put down rests below it; what it has lost may be anywhere near.
        """
        placed = base.compose(Pose2D(grip[0], grip[1], 0.0))
        before = held = self._tracker.held_by(hand)
        if hold.kind:
            grip_m = (placed.x_m, placed.y_m, grip[2])
            held = self._tracker.carry(hand, hold.kind, grip_m, stamp_ns)
        elif before is not None and hold.is_lost:
            self._tracker.lose(hand, f"the {hand} hand lost it: {hold.cause}")
        elif before is not None:
            self._tracker.release(hand)
            before.rests = self._rest_of(before, LET_GO)
        name = held.object_id if held is not None and hold.kind else None
        self._hands[hand] = hold.document(name)

    def document(self) -> KnownThings:
        """Return the scene topic's document."""
        lost = [track.document() for track in self._tracker.vanished[-MAX_LOST:]]
        known = [track.document() for track in self._tracker.objects]
        return {
            "stamp_ns": self.stamp_ns,
            "objects": _within(THINGS_BYTES - _size(lost), known),
            "surfaces": self._surfaces,
            "bystanders": [bystander.document() for bystander in self._bystanders],
            "lost": lost,
            "hands": self._hands,
        }

    def _rest_of(self, track: Track, begin: RelationBounds) -> Rest | None:
        things = [one.thing for one in self._tracker.objects]
        return rest_of(track.thing, things, self._book.surfaces, begin)

    def _surface(self, support: Support, base: Pose2D) -> SurfaceDocument:
        """Return a surface for the scene topic: the part in view, in the map frame."""
        x, y = (float(v) for v in support.outline.mean(axis=0))
        corners = [base.compose(Pose2D(float(u), float(v), 0.0)) for u, v in support.outline]
        polygon_m = [(corner.x_m, corner.y_m) for corner in corners]
        height_m = support.height_m(x, y)
        return {
            "name": self._book.look(height_m, polygon_m),
            "height_m": round(height_m, 4),
            "polygon_m": [[round(x_m, 3), round(y_m, 3)] for x_m, y_m in polygon_m],
        }


def _within(room_bytes: int, documents: list[ThingDocument]) -> list[ThingDocument]:
    """Return as many of the first documents as there is room for."""
    sums = itertools.accumulate(_size([one]) for one in documents)
    return [one for one, total in zip(documents, sums, strict=True) if total <= room_bytes]


def _size(documents: list[ThingDocument]) -> int:
    return len(json.dumps(documents, separators=(",", ":")))


def _sighting(detection: Detection, base: Pose2D, stamp_ns: int) -> Sighting:
    """Return a detection of the base frame as an observation in the map."""
    x, y, z = detection.position_m
    placed = base.compose(Pose2D(x, y, 0.0))
    on_map = replace(
        detection,
        position_m=(placed.x_m, placed.y_m, z),
        yaw_rad=half_turn(detection.yaw_rad + base.yaw_rad),
        covariance_m2=turned(detection.covariance_m2, base.yaw_rad),
    )
    covariance = covariance_of(on_map, math.hypot(x, y))
    seen = Estimate(
        position_m=np.array(on_map.position_m), covariance_m2=covariance, stamp_ns=stamp_ns
    )
    return Sighting(on_map, seen)


def _local(track: Track, base: Pose2D) -> Vector:
    """Return a track's place in the base frame."""
    x_m, y_m, z_m = track.position_m
    local = Pose2D(x_m, y_m, 0.0).relative_to(base)
    return local.x_m, local.y_m, z_m


def _known(surface: Surface, base: Pose2D) -> KnownSurface:
    corners = [Pose2D(x_m, y_m, 0.0).relative_to(base) for x_m, y_m in surface.polygon_m]
    outline = np.array([(corner.x_m, corner.y_m) for corner in corners], dtype=np.float32)
    return KnownSurface(height_m=surface.height_m, outline=counter_clockwise(outline))
