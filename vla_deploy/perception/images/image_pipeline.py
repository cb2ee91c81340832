"""Look at the camera's images: what stands in the way at once, what things are as soon as asked."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from drivers.camera.base import RgbdFrame
from drivers.clock import NS_PER_S
from vla_deploy.navigation.pose import Pose2D
from vla_deploy.perception.geometry.cloud import aim_sigma_rad
from vla_deploy.perception.geometry.geometry_grid import GeometryGrid, geometry_grid
from vla_deploy.perception.geometry.rotation import angle_rad
from vla_deploy.perception.images.detector_worker import Eyes
from vla_deploy.perception.images.frame_check import ImageUse
from vla_deploy.perception.images.frame_watch import FrameWatch
from vla_deploy.perception.images.network_view import NetworkView
from vla_deploy.perception.images.pinhole_view import as_pinhole, in_image
from vla_deploy.perception.objects.body_state import Array, BodyState
from vla_deploy.perception.objects.near_obstacles import NearObstacles
from vla_deploy.perception.objects.scene import Scene
from vla_deploy.perception.whereabouts import Whereabouts
from vla_deploy.world.surfaces import Point

# An image is used only where the camera was nearly still before its exposure.
STILL_WINDOW_NS: Final = 60_000_000
MAX_CAMERA_TURN_RAD_S: Final = 0.35


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ImageMoment:
    """Hold an image and how the robot stood when it was taken.

    `seen` is the image on the geometry's `grid`, with its depth in metres and a mask of the robot;
    `track` is where it was by dead reckoning, `view` turns the camera into that frame, 3 x 3: a
    robot that finds out where it really is has not moved.
    """

    grid: GeometryGrid
    seen: RgbdFrame
    depth_m: NDArray[np.float32]
    base_from_camera: Array
    base: Pose2D
    track: Pose2D
    body: NDArray[np.bool_]
    view: Array
    turn_rad_s: float


class Looking:
    """Turn images into obstacles and a scene; one image at a time waits for the network."""

    def __init__(
        self,
        body: BodyState,
        whereabouts: Whereabouts,
        eyes: Eyes,
        furniture: Mapping[str, Point],
    ) -> None:
        self.scene = Scene(furniture)
        self.obstacles = NearObstacles()
        self._body = body
        self._whereabouts = whereabouts
        self._eyes = eyes
        self._watch = FrameWatch()
        self._waiting: ImageMoment | None = None

    def came(self, frame: RgbdFrame, now_ns: int) -> None:
        """Take note that an image has come, whether it is looked at or not."""
        self._watch.came(frame, now_ns)

    def see(self, frame: RgbdFrame) -> bool:
        """Take a new image; return whether the obstacles around are new."""
        positions = self._body.at(frame.stamp_ns)
        if positions is None:
            return False
        moment = self._moment(frame, positions)
        verdict = self._watch.judge(frame, frame.depth_m(), moment.view, moment.track)
        if verdict.use < ImageUse.OBSTACLES:
            return False
        hands = self._body.hands(positions, frame.stamp_ns)
        grips = [np.array(hand.grip) for hand in hands if hand.hold.kind]
        self.obstacles.look(
            moment.depth_m,
            moment.seen.intrinsics,
            moment.base_from_camera,
            moment.body,
            moment.base,
            grips,
            frame.stamp_ns,
        )
        still = moment.turn_rad_s <= MAX_CAMERA_TURN_RAD_S
        # A pose that the lidar has not borne out yet would put things where they never were.
        placed = still and self._whereabouts.is_borne_out
        if placed and verdict.use >= ImageUse.FORM and self._waiting is None:
            self._waiting = moment
            if verdict.use >= ImageUse.ALL:
                self._eyes.ask(as_pinhole(frame))
        return True

    def finish(self) -> bool:
        """Take what the network has answered; return whether the scene is new."""
        answer = self._eyes.answer() if self._waiting is not None else None
        if self._waiting is None or answer is None:
            return False
        moment, self._waiting = self._waiting, None
        self._look(moment, moment.grid.view(in_image(answer.view, moment.grid.source)))
        return True

    def carry(self, positions: Array, now_ns: int) -> None:
        """Let the things that hands hold, as told and felt, move along with the hands."""
        pose = self._whereabouts.pose
        for hand in self._body.hands(positions, now_ns):
            self.scene.hold(hand.name, hand.hold, hand.grip, pose, now_ns)

    def document(self, now_ns: int) -> dict[str, Any]:
        """Return the scene topic's document, with how things are named, and how images are.

        The robot's own place is in it as long as it is not lost.
        """
        pose = self._whereabouts.pose
        robot = {"x_m": pose.x_m, "y_m": pose.y_m, "yaw_rad": pose.yaw_rad}
        return {
            **self.scene.document(),
            "robot": None if self._whereabouts.is_lost else robot,
            "sight": self._eyes.document(),
            "image": self._watch.document(now_ns),
        }

    def _look(self, moment: ImageMoment, network: NetworkView | None) -> None:
        self.scene.look(
            moment.seen.rgb,
            moment.depth_m,
            moment.seen.intrinsics,
            moment.base_from_camera,
            moment.base,
            moment.body,
            moment.seen.stamp_ns,
            network,
            aim_sigma_rad(moment.turn_rad_s),
        )

    def _moment(self, frame: RgbdFrame, positions: Array) -> ImageMoment:
        track = self._whereabouts.track_at(frame.stamp_ns)
        view = self._body.view_rotation(frame.stamp_ns, track)
        grid = geometry_grid(frame.intrinsics)
        seen = grid.frame(frame)
        return ImageMoment(
            grid=grid,
            seen=seen,
            depth_m=seen.depth_m(),
            base_from_camera=self._body.camera_pose(positions),
            base=self._whereabouts.pose_at(frame.stamp_ns),
            track=track,
            body=self._body.mask(positions, seen.intrinsics),
            view=view,
            turn_rad_s=self._camera_turn(view, frame.stamp_ns),
        )

    def _camera_turn(self, view: Array, stamp_ns: int) -> float:
        """Return how fast the camera turned up to a moment."""
        before_ns = stamp_ns - STILL_WINDOW_NS
        before = self._body.view_rotation(before_ns, self._whereabouts.track_at(before_ns))
        return angle_rad(before.T @ view) * NS_PER_S / STILL_WINDOW_NS
