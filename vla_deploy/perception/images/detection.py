"""Find things in an RGB-D image: clusters on supports, named by form and detector."""

import math
from dataclasses import dataclass

import numpy as np

from vla_deploy.perception.geometry.cloud import DEPTH_SIGMA_PER_M, Cloud
from vla_deploy.perception.geometry.clusters import (
    Cluster,
    find_clusters,
    split_apart,
    split_by_colour,
)
from vla_deploy.perception.geometry.placement import Matrix, place
from vla_deploy.perception.geometry.placement import Vector as Vector
from vla_deploy.perception.geometry.shapes import (
    MeasuredShape,
    Rectangle,
    inside_rectangle,
    measure,
)
from vla_deploy.perception.geometry.supports import Support
from vla_deploy.perception.images.network_view import NetworkView
from vla_deploy.perception.naming.class_fusion import Name, NameSource, fuse_name, name_by_form
from vla_deploy.perception.naming.classes import OTHER, Form, judge_form
from vla_deploy.perception.naming.colour import dominant_colour
from vla_deploy.world.vocabulary import CONTAINERS

FEW_PIXELS = 60
FLAT_SIGMAS = 4.0
BOX_FLOOR_M = 0.02
WALL_M = 0.02
FACE_WIDTH_M, FACE_HEIGHT_M = 0.03, 0.05


@dataclass(frozen=True, slots=True, kw_only=True)
class Detection:
    """Hold one thing as one image shows it, in the frame of the cloud.

    `position_m` is its centre: for a box that of its rim's rectangle, half its height below the
    rim. `size_m` is length along yaw, width, height. Class and measures of a truncated thing are
    guesses: the image's border or something nearer hides its end or its top. The covariance of the
    position and the sigmas of size and yaw grow with what is not seen.
    """

    class_name: str
    colour: str
    position_m: Vector
    size_m: Vector
    yaw_rad: float
    confidence: float
    truncated: bool
    occluded: bool
    box_px: tuple[int, int, int, int]
    covariance_m2: Matrix
    size_sigma_m: Vector
    yaw_sigma_rad: float
    named_by: NameSource


@dataclass(frozen=True, slots=True)
class _View:
    """Hold one image: its points, and what the detector found in it, if there is one at work."""

    cloud: Cloud
    network: NetworkView | None


def detect(
    cloud: Cloud, supports: list[Support], network: NetworkView | None = None
) -> list[Detection]:
    """Return the things that stand on the supports, the nearest first.

    Place and size come from their points alone, the name from their form and the detector.
    """
    view = _View(cloud, network)
    clusters = find_clusters(cloud, supports)
    clusters.sort(key=lambda cluster: cluster.depth_m)
    found = [detection for cluster in clusters for detection in _detections(cluster, view)]
    boxes = [detection for detection in found if detection.class_name == "box"]
    return [
        detection
        for detection in found
        if not _is_bare_face(detection) and not any(_is_floor_of(box, detection) for box in boxes)
    ]


def _is_floor_of(box: Detection, detection: Detection) -> bool:
    """Return whether this is the bottom of an open box, which shows between its walls."""
    inside = math.dist(box.position_m[:2], detection.position_m[:2]) < 0.5 * box.size_m[1]
    flat = detection.size_m[2] < BOX_FLOOR_M
    return detection is not box and inside and flat and detection.colour == box.colour


def _is_bare_face(detection: Detection) -> bool:
    """Return whether this is one upright side of something larger, such as a sofa's arm."""
    _, width_m, height_m = detection.size_m
    return detection.class_name == OTHER and width_m < FACE_WIDTH_M and height_m > FACE_HEIGHT_M


def _detections(cluster: Cluster, view: _View) -> list[Detection]:
    """Return one thing, or several that touch where each part by itself is a known one."""
    whole = _detection(cluster, view)
    if whole.class_name in CONTAINERS:
        return [whole, *_contents(whole, cluster, view)]
    if whole.named_by in (NameSource.FORM, NameSource.BOTH):
        return [whole]
    parts = [_detection(part, view) for part in split_by_colour(cluster, view.cloud)]
    return [whole] if any(part.class_name == OTHER for part in parts) else parts


def _contents(box: Detection, cluster: Cluster, view: _View) -> list[Detection]:
    """Return the known things that stand within a box's walls.

    Between its walls a corner of the rim may show a pixel of its own, which belongs to nothing.
    """
    x, y, _ = box.position_m
    length_m, width_m, _ = box.size_m
    rim = Rectangle(centre=(x, y), length_m=length_m, width_m=width_m, yaw_rad=box.yaw_rad)
    within = inside_rectangle(cluster.points[:, :2], rim, WALL_M)
    parts = split_apart(cluster, view.cloud, within & (cluster.heights > BOX_FLOOR_M))
    contents = (_detection(part, view) for part in parts)
    return [one for one in contents if one.class_name != OTHER and one.colour != box.colour]


def _least_height_m(cluster: Cluster) -> float:
    """Return the height below which the depth noise alone may look like a flat thing."""
    return FLAT_SIGMAS * DEPTH_SIGMA_PER_M * cluster.depth_m**2


def _name(cluster: Cluster, shape: MeasuredShape, network: NetworkView | None) -> Name:
    form = judge_form(shape, whole=not (cluster.truncated or cluster.occluded))
    if shape.height_m <= _least_height_m(cluster):
        form = Form(name=OTHER, fits=frozenset(), impossible=form.impossible)
    if network is None:
        return name_by_form(form)
    votes = network.votes_for(cluster.box_px)
    if not votes:
        return name_by_form(form, network.recall_at(cluster.box_px, form.name))
    return fuse_name(form, votes)


def _detection(cluster: Cluster, view: _View) -> Detection:
    shape = measure(cluster, view.cloud.camera_position, view.cloud.camera.fx)
    name = _name(cluster, shape, view.network)
    colour, share = dominant_colour(cluster.rgb[cluster.upper()])
    placed = place(cluster, shape, name.class_name, view.cloud)
    enough = min(1.0, math.sqrt(len(cluster.points) / FEW_PIXELS))
    whole = 0.6 if cluster.truncated or cluster.occluded else 1.0
    return Detection(
        class_name=name.class_name,
        colour=colour,
        position_m=placed.position_m,
        size_m=placed.size_m,
        yaw_rad=placed.yaw_rad,
        confidence=float(np.round(name.confidence * enough * whole * (0.7 + 0.3 * share), 3)),
        truncated=cluster.truncated,
        occluded=cluster.occluded,
        box_px=cluster.box_px,
        covariance_m2=placed.covariance_m2,
        size_sigma_m=placed.size_sigma_m,
        yaw_sigma_rad=placed.yaw_sigma_rad,
        named_by=name.source,
    )
