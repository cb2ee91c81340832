"""Monitor the images over time: frozen, torn or repeated ones, and a camera gone silent."""

import math
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from drivers.camera.base import RgbdFrame
from drivers.clock import NS_PER_S
from vla_deploy.ipc.payloads.scene import ImageStatus
from vla_deploy.perception.geometry.cloud import Floats
from vla_deploy.perception.images.frame_check import (
    STALE_COLOUR_RATIO,
    ImageUse,
    ImageVerdict,
    judge_frame,
)
from vla_deploy.perception.images.frame_statistics import (
    FrameSignature,
    FrameStatistics,
    measure_frame,
)
from vla_deploy.robots.floor_pose import Pose2D
from vla_deploy.robots.kinematics.orientation import angle_rad

VIEW_DISTANCE_M: Final = 3.0
"""Driving by one metre changes the view as turning by one over this does."""
MOVED_RAD: Final = 0.01
"""Change of view by which rows with contrast change; at rest, pose and joints say less."""
REST_NS: Final = 20 * NS_PER_S
"""A change of view of less than `MOVED_RAD` in this time is none: dead reckoning drifts."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CameraView:
    """Hold the camera's rotation, 3 x 3, and the base's pose, in a frame without jumps."""

    stamp_ns: int
    rotation: NDArray[np.float64]
    base: Pose2D

    def change_rad(self, other: "CameraView") -> float:
        """Return by how much the view changes from here to there."""
        driven_m = math.hypot(other.base.x_m - self.base.x_m, other.base.y_m - self.base.y_m)
        return angle_rad(self.rotation.T @ other.rotation) + driven_m / VIEW_DISTANCE_M


class ViewChange:
    """Add up by how much the view has changed since a start; at rest nothing is added."""

    def __init__(self, start: CameraView) -> None:
        self._from = start
        self._before_rad = 0.0

    def rad(self, view: CameraView) -> float:
        """Return the change of view up to a moment."""
        change_rad = self._from.change_rad(view)
        moved_rad = self._before_rad + change_rad
        if view.stamp_ns - self._from.stamp_ns >= REST_NS:
            if change_rad >= MOVED_RAD:
                self._before_rad = moved_rad
            self._from = view
        return moved_rad


class FrameMonitor:
    """Judge each image by itself and against those before it.

    `_unmoved` is the first of the images that show the same; `_repeated` the first of those that
    share too many rows of colour to the bit. What a robot at rest sees may well be the same, so
    both count only once the camera has moved. Images of a camera that measures no depth are not
    judged by it.
    """

    def __init__(self, *, has_depth: bool = True) -> None:
        self._has_depth = has_depth
        self._before: tuple[RgbdFrame, ...] = ()
        self._unmoved: tuple[FrameSignature, ViewChange] | None = None
        self._repeated: tuple[FrameSignature, ViewChange] | None = None
        self._received_ns: int | None = None
        self._verdict = ImageVerdict(use=ImageUse.ALL, faults=())
        self._refused = 0

    def receive(self, frame: RgbdFrame, now_ns: int) -> None:
        """Keep an image that has arrived: the next one may be torn with it, judged or not."""
        self._received_ns = now_ns
        self._before = (*self._before[-2:], frame)

    def judge(
        self, frame: RgbdFrame, depth_m: Floats, rotation: NDArray[np.float64], base: Pose2D
    ) -> ImageVerdict:
        """Return what an image is good for.

        `rotation` is the camera's, 3 x 3, and `base` the robot's pose, in a frame without jumps.
        """
        signature = FrameSignature.of(frame)
        view = CameraView(stamp_ns=frame.stamp_ns, rotation=rotation, base=base)
        statistics = replace(
            measure_frame(frame.rgb, depth_m),
            stale_ratio=max(
                (signature.stale_ratio(one.depth) for one in self._before if one is not frame),
                default=0.0,
            ),
            stale_colour_ratio=self._stale_colour_ratio(signature, view),
            unmoved_rad=self._unmoved_rad(signature, view),
        )
        if not self._has_depth:
            statistics = replace(statistics, hole_ratio=0.0)
        self._verdict = judge_frame(statistics)
        self._refused += self._verdict.use is ImageUse.NOTHING
        return self._verdict

    def refuse(self, faults: tuple[str, ...]) -> None:
        """Record why the image that was judged last is good for nothing after all."""
        self._verdict = ImageVerdict(use=ImageUse.NOTHING, faults=faults)
        self._refused += 1

    def document(self, now_ns: int) -> ImageStatus:
        """Return the verdict on the last image, or that none arrives, for the scene topic."""
        if self._received_ns is None:
            self._received_ns = now_ns
        silence = judge_frame(FrameStatistics(silent_s=(now_ns - self._received_ns) / NS_PER_S))
        verdict = silence if silence.faults else self._verdict
        return {
            "use": verdict.use.name.lower(),
            "faults": list(verdict.faults),
            "refused": self._refused,
        }

    def _unmoved_rad(self, signature: FrameSignature, view: CameraView) -> float:
        if self._unmoved is None or not signature.shows_the_same(self._unmoved[0]):
            self._unmoved = (signature, ViewChange(view))
            return 0.0
        return self._unmoved[1].rad(view)

    def _stale_colour_ratio(self, signature: FrameSignature, view: CameraView) -> float:
        """Return the share of rows of colour that repeat, 0 unless the camera moved meanwhile."""
        first, self._repeated = self._repeated, (signature, ViewChange(view))
        if first is None:
            return 0.0
        ratio = signature.stale_colour_ratio(first[0])
        if ratio > STALE_COLOUR_RATIO:
            self._repeated = first
        return ratio if first[1].rad(view) >= MOVED_RAD else 0.0
