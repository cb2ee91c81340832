"""Maintain the scene: the detections of each image, moved to the map frame, tracked over time."""

import itertools
import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from vla_deploy.ipc.payloads.scene import HandDocument, KnownThings, SurfaceDocument, ThingDocument
from vla_deploy.perception.geometry.cloud import Cloud, PosedImage, make_cloud
from vla_deploy.perception.geometry.lens import project
from vla_deploy.perception.geometry.placement import turned
from vla_deploy.perception.geometry.shapes import half_turn
from vla_deploy.perception.geometry.supports import (
    KnownSurface,
    Support,
    counter_clockwise,
    find_supports,
)
from vla_deploy.perception.images.detection import Detection, Vector, detect
from vla_deploy.perception.images.network_view import NetworkView
from vla_deploy.perception.objects.body_state import Hold
from vla_deploy.perception.objects.bystanders import Bystander, find_bystanders
from vla_deploy.perception.objects.filtering import Estimate, covariance_of
from vla_deploy.perception.objects.track import Sighting, Track
from vla_deploy.perception.objects.tracker import Tracker
from vla_deploy.robots.floor_pose import Pose2D
from vla_deploy.world.document import read_snapshot
from vla_deploy.world.resting import BEGIN, LET_GO, RelationBounds, rest_of
from vla_deploy.world.surfaces import Point, SurfaceBook
from vla_deploy.world.thing import Rest, Surface
from vla_deploy.world.vocabulary import CONTAINERS

# The share of the scene's cell that is for things, the most recently seen first.
THINGS_BYTES = 25_000
MAX_LOST = 12
# Further away a thing may be overlooked.
CLEAR_RANGE_M = 1.6
BORDER_PX = 12
PATCH_PX = 2
IN_FRONT_M = 0.05
# What is lower than this shows no nearer than what it lies on.
FLAT_M = 0.04
# The robot's own parts are taken out of an image with a margin, and with them the edge of a thing
# between the fingers: what is left of a small one is no thing any more.
BESIDE_BODY_M = 0.03
# Over an empty place the camera sees this share of the thing's height further.
THROUGH_RATIO = 0.25


class Scene:
    """Hold the known things around the robot; `furniture` names points of the home's surfaces.

    The floor is `floor_m` high in the base frame; None for a robot that is mounted on a table.
    """

    def __init__(
        self, furniture: Mapping[str, Point] | None = None, floor_m: float | None = 0.0
    ) -> None:
        self._floor_m = floor_m
        self._tracker = Tracker()
        self._book = SurfaceBook(furniture, floor_m)
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
        known = [_known(one, base) for one in self._book.surfaces]
        supports = find_supports(cloud, known, self._floor_m)
        self._surfaces = [self._surface(one, base) for one in supports if not one.is_floor]
        found = detect(cloud, supports, network)
        sightings = [_sighting(detection, base, stamp_ns) for detection in found]
        self._bystanders = find_bystanders(cloud, network, base)
        in_view = [
            track
            for track in self._tracker.tracks
            if is_in_clear_view(
                (*base.local(track.position_m), track.position_m[2]), track.size_m, cloud, found
            )
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
        before = held = self._tracker.held_by(hand)
        if hold.kind:
            grip_m = (*base.outward(grip[0], grip[1]), grip[2])
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
        return rest_of(track.thing, things, self._book.surfaces, begin, self._floor_m)

    def _surface(self, support: Support, base: Pose2D) -> SurfaceDocument:
        """Return a surface for the scene topic: the part in view, in the map frame."""
        x, y = (float(v) for v in support.outline.mean(axis=0))
        polygon_m = [base.outward(float(u), float(v)) for u, v in support.outline]
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
    on_map = replace(
        detection,
        position_m=(*base.outward(x, y), z),
        yaw_rad=half_turn(detection.yaw_rad + base.yaw_rad),
        covariance_m2=turned(detection.covariance_m2, base.yaw_rad),
    )
    covariance = covariance_of(on_map, math.hypot(x, y))
    seen = Estimate(
        position_m=np.array(on_map.position_m), covariance_m2=covariance, stamp_ns=stamp_ns
    )
    return Sighting(on_map, seen)


def _known(surface: Surface, base: Pose2D) -> KnownSurface:
    outline = np.array([base.local(corner) for corner in surface.polygon_m], dtype=np.float32)
    return KnownSurface(height_m=surface.height_m, outline=counter_clockwise(outline))


def is_in_clear_view(
    place: Vector, size_m: Vector, cloud: Cloud, found: Sequence[Detection]
) -> bool:
    """Return whether an image shows a thing's place (base frame) with nothing in front of it.

    Where something stands that no detection explains, it may well be the thing: its place is not in
    clear view then. Neither is one out of the image or too far away.
    """
    camera = cloud.camera
    x, y, z = cloud.base_from_camera[:3, :3].T @ (np.array(place) - cloud.camera_position)
    if not 0.2 < z < CLEAR_RANGE_M:
        return False
    half = math.ceil(0.5 * camera.fx * max(size_m) / z)
    border = BORDER_PX + half
    u, v = (round(value) for value in project(camera, np.array([[x, y, z]]))[0])
    if not (border <= u < camera.width - border and border <= v < camera.height - border):
        return False
    reach = half + math.ceil(camera.fx * BESIDE_BODY_M / z)
    around = np.s_[max(0, v - reach) : v + reach + 1, max(0, u - reach) : u + reach + 1]
    patch = np.s_[v - PATCH_PX : v + PATCH_PX + 1, u - PATCH_PX : u + PATCH_PX + 1]
    if cloud.own_body[around].any() or not cloud.valid[patch].all():
        return False
    depth_m = float(np.median(cloud.depth_m[patch]))
    is_hidden = depth_m < z - 0.5 * max(size_m) - IN_FRONT_M
    return not (is_hidden or _is_unexplained(depth_m - z, place, size_m, found))


def _is_unexplained(
    beyond_m: float, place: Vector, size_m: Vector, found: Sequence[Detection]
) -> bool:
    """Return whether something is where a thing was that no detection explains.

    A box around the place explains nothing: the thing may stand in it.
    """
    height_m = size_m[2]
    if height_m < FLAT_M or beyond_m > THROUGH_RATIO * height_m:
        return False
    return not any(
        math.dist(one.position_m[:2], place[:2]) < 0.5 * (max(one.size_m[:2]) + min(size_m[:2]))
        for one in found
        if one.class_name not in CONTAINERS or max(one.size_m[:2]) < 2.0 * max(size_m[:2])
    )
