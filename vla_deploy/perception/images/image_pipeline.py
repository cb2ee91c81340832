"""Process the camera's images: near obstacles at once, things once the detector has answered."""

from collections.abc import Mapping
from typing import Final, Protocol

import numpy as np

from drivers.camera.base import RgbdFrame
from drivers.clock import NS_PER_S
from vla_deploy.client.place_state import PlaceState
from vla_deploy.ipc.payloads.scene import RobotPlace, SceneDocument
from vla_deploy.perception.geometry.cloud import PosedImage, aim_sigma_rad
from vla_deploy.perception.geometry.geometry_grid import GeometryGrid, geometry_grid
from vla_deploy.perception.geometry.plane_depth import PlaneDepth, TableImage
from vla_deploy.perception.images.detector_worker import DetectorWorker
from vla_deploy.perception.images.frame_check import ImageUse
from vla_deploy.perception.images.frame_monitor import FrameMonitor
from vla_deploy.perception.images.known_view import with_known
from vla_deploy.perception.images.network_view import as_pinhole, to_camera_image
from vla_deploy.perception.objects.body_state import Array, BodyState
from vla_deploy.perception.objects.near_obstacles import NearObstacles
from vla_deploy.perception.objects.scene import Scene
from vla_deploy.robots.floor_pose import Pose2D
from vla_deploy.robots.kinematics.orientation import angle_rad
from vla_deploy.world.surfaces import Point

# Things are placed by images before whose exposure the camera was nearly still.
STILL_WINDOW_NS: Final = 60_000_000
MAX_CAMERA_TURN_RAD_S: Final = 0.35


class BasePose(Protocol):
    """Say where the base is and was, in the map and by dead reckoning, and what that is worth."""

    @property
    def pose(self) -> Pose2D:
        """Return where the base is now, in the map."""

    @property
    def state(self) -> PlaceState:
        """Return what the pose is worth."""

    @property
    def is_anchored(self) -> bool:
        """Return whether the pose has been confirmed since the start."""

    def pose_at(self, stamp_ns: int) -> Pose2D:
        """Return where the base was."""

    def track_at(self, stamp_ns: int) -> Pose2D:
        """Return where the base was by dead reckoning alone."""


class ImagePipeline:
    """Turn images into obstacles and a scene; one image at a time waits for the detector.

    The floor is `floor_m` high in the base frame, None where the robot does not stand on it. With
    `plane_depth`, images come without depth and get it from there.
    """

    def __init__(
        self,
        body: BodyState,
        localiser: BasePose,
        worker: DetectorWorker,
        furniture: Mapping[str, Point],
        floor_m: float | None = 0.0,
        plane_depth: PlaneDepth | None = None,
    ) -> None:
        self.scene = Scene(furniture, floor_m)
        self.obstacles = NearObstacles()
        self._body = body
        self._localiser = localiser
        self._worker = worker
        self._plane_depth = plane_depth
        self._monitor = FrameMonitor(has_depth=plane_depth is None)
        self._waiting: tuple[TableImage, GeometryGrid] | None = None

    def receive(self, frame: RgbdFrame, now_ns: int) -> None:
        """Record that an image has arrived, whether it is processed or not."""
        self._monitor.receive(frame, now_ns)

    def process(self, frame: RgbdFrame) -> bool:
        """Process a new image; return whether the obstacles around are new."""
        positions = self._body.at(frame.stamp_ns)
        if positions is None:
            return False
        # By dead reckoning: a robot that finds out where it really is has not moved its camera.
        track = self._localiser.track_at(frame.stamp_ns)
        view = self._body.view_rotation(frame.stamp_ns, track)
        verdict = self._monitor.judge(frame, frame.depth_m(), view, track)
        if verdict.use < ImageUse.OBSTACLES:
            return False
        grid = geometry_grid(frame.intrinsics)
        turn_rad_s = self._camera_turn_rad_s(view, frame.stamp_ns)
        seen = self._with_depth(self._posed(grid.frame(frame), positions, turn_rad_s))
        if seen.faults:
            self._monitor.refuse(seen.faults)
            return False
        image = seen.image
        hands = self._body.hands(positions, frame.stamp_ns)
        self.obstacles.update(image, [np.array(one.grip) for one in hands if one.hold.kind])
        # A pose that the lidar has not confirmed yet would put things where they never were.
        is_placed = turn_rad_s <= MAX_CAMERA_TURN_RAD_S and self._localiser.is_anchored
        if is_placed and verdict.use >= ImageUse.FORM and self._waiting is None:
            self._waiting = (seen, grid)
            if verdict.use >= ImageUse.ALL:
                self._worker.ask(as_pinhole(frame))
        return True

    def finish(self) -> bool:
        """Take what the detector has answered; return whether the scene is new."""
        answer = self._worker.answer() if self._waiting is not None else None
        if self._waiting is None or answer is None:
            return False
        (seen, grid), self._waiting = self._waiting, None
        network = grid.view(to_camera_image(answer.view, grid.source))
        self.scene.update(seen.image, with_known(network, seen.sights))
        return True

    def move_held(self, positions: Array, now_ns: int) -> None:
        """Move the things that hands hold, as reported and felt, along with the hands."""
        pose = self._localiser.pose
        for hand in self._body.hands(positions, now_ns):
            self.scene.hold(hand.name, hand.hold, hand.grip, pose, now_ns)

    def document(self, now_ns: int, away: dict[str, str]) -> SceneDocument:
        """Return the scene topic's document; `away` says why sensors give nothing.

        The robot's own pose is in it as long as it is not lost.
        """
        pose = self._localiser.pose
        is_lost = self._localiser.state is PlaceState.LOST
        robot: RobotPlace = {"x_m": pose.x_m, "y_m": pose.y_m, "yaw_rad": pose.yaw_rad}
        return {
            **self.scene.document(),
            "robot": None if is_lost else robot,
            "sight": self._worker.document(),
            "image": self._monitor.document(now_ns),
            "away": away,
        }

    def _with_depth(self, image: PosedImage) -> TableImage:
        return TableImage(image=image) if self._plane_depth is None else self._plane_depth.of(image)

    def _posed(self, frame: RgbdFrame, positions: Array, turn_rad_s: float) -> PosedImage:
        return PosedImage(
            rgb=frame.rgb,
            depth_m=frame.depth_m(),
            camera=frame.intrinsics,
            base_from_camera=self._body.camera_pose(positions),
            body=self._body.mask(positions, frame.intrinsics),
            base=self._localiser.pose_at(frame.stamp_ns),
            stamp_ns=frame.stamp_ns,
            aim_sigma_rad=aim_sigma_rad(turn_rad_s),
        )

    def _camera_turn_rad_s(self, view: Array, stamp_ns: int) -> float:
        """Return how fast the camera turned up to a moment."""
        before_ns = stamp_ns - STILL_WINDOW_NS
        before = self._body.view_rotation(before_ns, self._localiser.track_at(before_ns))
        return angle_rad(before.T @ view) * NS_PER_S / STILL_WINDOW_NS
