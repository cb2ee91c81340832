"""What stands up from the floor is told, kept while it is out of view, and forgotten when gone."""

import math

import numpy as np
from numpy.typing import NDArray

from drivers.camera.protocol import Intrinsics
from drivers.clock import NS_PER_S
from vla_deploy.ipc.topics import OBSTACLE_POINTS
from vla_deploy.perception.geometry.cloud import PosedImage
from vla_deploy.perception.objects.near_obstacles import KEPT_NS, NearObstacles
from vla_deploy.robots.floor_pose import Pose2D

CAMERA = Intrinsics(width=160, height=120, fx=110.0, fy=110.0, cx=79.5, cy=59.5)
HEIGHT_M = 1.2
TILT_RAD = 0.6
NO_BODY = np.zeros((120, 160), dtype=np.bool_)
HERE = Pose2D(0.0, 0.0, 0.0)


def camera_pose() -> NDArray[np.float64]:
    """Return a camera above the base's centre that looks ahead and down."""
    c, s = math.cos(TILT_RAD), math.sin(TILT_RAD)
    pose = np.eye(4)
    pose[:3, :3] = np.column_stack(((0.0, -1.0, 0.0), (-s, 0.0, -c), (c, 0.0, -s)))
    pose[:3, 3] = (0.0, 0.0, HEIGHT_M)
    return pose


def rays() -> NDArray[np.float64]:
    """Return each pixel's ray in the base frame, of unit depth."""
    columns, rows = np.meshgrid(np.arange(160), np.arange(120))
    local = np.stack(
        ((columns - CAMERA.cx) / CAMERA.fx, (rows - CAMERA.cy) / CAMERA.fy, np.ones((120, 160))),
        axis=-1,
    )
    return local @ camera_pose()[:3, :3].T


def floor() -> NDArray[np.float32]:
    down = -rays()[..., 2]
    return np.where(down > 0.05, HEIGHT_M / np.maximum(down, 0.05), 0.0).astype(np.float32)


def post(x_m: float, y_m: float, half_m: float = 0.05, top_m: float = 0.3) -> NDArray[np.float32]:
    """Return the floor with an upright slab that faces the robot at x."""
    ray, depth = rays(), floor()
    ahead = np.maximum(ray[..., 0], 1e-6)
    there = x_m / ahead
    points = ray * there[..., None] + (0.0, 0.0, HEIGHT_M)
    hit = (
        (np.abs(points[..., 1] - y_m) < half_m) & (points[..., 2] > 0.0) & (points[..., 2] < top_m)
    )
    return np.where(hit, there, depth).astype(np.float32)


def look(
    seen: NearObstacles,
    depth: NDArray[np.float32],
    pose: Pose2D = HERE,
    stamp_ns: int = 0,
    body: NDArray[np.bool_] = NO_BODY,
    grips: tuple[NDArray[np.float64], ...] = (),
) -> NDArray[np.float64]:
    image = PosedImage(
        rgb=np.zeros((*depth.shape, 3), np.uint8),
        depth_m=depth,
        camera=CAMERA,
        base_from_camera=camera_pose(),
        body=body,
        base=pose,
        stamp_ns=stamp_ns,
    )
    seen.update(image, grips)
    return seen.around(pose, stamp_ns)


def test_the_bare_floor_is_no_obstacle() -> None:
    assert len(look(NearObstacles(), floor())) == 0


def test_a_post_is_told_where_it_stands_nearest_first() -> None:
    points = look(NearObstacles(), post(1.2, 0.1))
    assert len(points) > 0
    assert np.abs(points[:, 0] - 1.2).max() < 0.02
    assert np.abs(points[:, 1] - 0.1).max() < 0.06
    distance = np.linalg.norm(points[:, :2], axis=1)
    assert (np.diff(distance) >= 0.0).all()


def test_what_is_out_of_view_is_kept_where_it_was() -> None:
    seen = NearObstacles()
    look(seen, post(1.2, 0.0))
    turned = Pose2D(0.9, 0.0, math.pi / 2)
    points = look(seen, floor(), turned, NS_PER_S)
    assert len(points) > 0
    assert np.abs(points[:, 1] + 0.3).max() < 0.03


def test_what_is_looked_through_is_gone_at_once_and_the_rest_in_time() -> None:
    seen = NearObstacles()
    look(seen, post(1.2, 0.0))
    assert len(look(seen, floor(), stamp_ns=1)) == 0
    look(seen, post(1.2, 0.0), stamp_ns=2)
    away = Pose2D(0.9, 0.0, math.pi / 2)
    assert len(seen.around(away, 2 + KEPT_NS)) > 0
    assert len(seen.around(away, 3 + KEPT_NS)) == 0


def test_a_thing_close_before_another_is_seen_to_be_gone() -> None:
    seen = NearObstacles()
    look(seen, np.minimum(post(1.2, 0.0), post(1.28, 0.0, half_m=0.5)))
    points = look(seen, post(1.28, 0.0, half_m=0.5), stamp_ns=1)
    assert len(points) > 0
    assert points[:, 0].min() > 1.25


def test_what_stays_is_not_forgotten_by_noise_or_a_pose_that_is_a_little_off() -> None:
    seen, noise = NearObstacles(), np.random.default_rng(0).normal(0.0, 0.003, (120, 160))
    first = look(seen, post(1.2, 0.0))
    off = Pose2D(0.01, 0.01, 0.005)
    again = look(seen, post(1.2, 0.0) + noise.astype(np.float32), off, 1)
    assert len(again) >= len(first)


def test_what_a_hand_takes_is_forgotten_out_of_view_and_what_stands_beside_it_is_kept() -> None:
    seen = NearObstacles()
    look(seen, np.minimum(post(1.2, 0.0), post(1.2, 0.4)))
    turned = Pose2D(1.2, 0.4, math.pi)  # both are behind the camera's back
    before = look(seen, floor(), turned, 1)
    points = look(seen, floor(), turned, 2, grips=(before[0],))
    assert 0 < len(points) < len(before)
    assert np.linalg.norm(points - before[0], axis=1).min() > 0.09


def test_the_own_body_and_what_a_hand_holds_are_no_obstacles() -> None:
    body = np.ones_like(NO_BODY)
    assert len(look(NearObstacles(), post(1.0, 0.0), body=body)) == 0
    grip = np.array((1.0, 0.0, 0.2))
    assert len(look(NearObstacles(), post(1.0, 0.0), grips=(grip,))) == 0


def test_far_things_are_kept_but_told_only_when_they_are_near() -> None:
    seen = NearObstacles()
    assert len(look(seen, post(2.2, 0.0))) == 0
    assert len(seen.around(Pose2D(1.2, 0.0, 0.0), 0)) > 0


def test_no_more_points_are_told_than_the_topic_holds() -> None:
    seen = NearObstacles()
    for step in range(12):
        look(seen, post(1.0, 0.0, half_m=1.0), Pose2D(0.0, 0.0, step * math.pi / 6))
    assert len(seen.around(HERE, 0)) <= OBSTACLE_POINTS


def test_who_walked_away_is_forgotten_and_what_stood_there_before_is_kept() -> None:
    seen = NearObstacles()
    look(seen, post(1.0, 0.4), stamp_ns=0)
    with_them = np.minimum(post(1.0, 0.4), post(1.0, -0.3))
    look(seen, with_them, stamp_ns=NS_PER_S)
    assert len(seen.on_map(NS_PER_S))
    left = np.array(((NS_PER_S, 1.0, -0.1),))
    seen.forget_left(left)
    points = seen.on_map(NS_PER_S)
    assert len(points)
    assert (points[:, 1] > 0.0).all()
    seen.forget_left(np.array(((5.0 * NS_PER_S, 1.0, 0.4),)))
    assert len(seen.on_map(NS_PER_S)) == len(points), "seen at another moment"
