"""Watch the images that come, and whether any do: each by itself and beside those before."""

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drivers.camera.base import RgbdFrame
from drivers.clock import NS_PER_S
from vla_deploy.navigation.pose import Pose2D
from vla_deploy.perception.geometry.cloud import Floats
from vla_deploy.perception.images.frame_check import (
    STALE_COLOUR_RATIO,
    ImageUse,
    ImageVerdict,
    judge_frame,
)
from vla_deploy.perception.images.frame_repeats import CameraStand, Repeats, Travel
from vla_deploy.perception.images.frame_statistics import FrameStatistics, Glance, measure_frame


class FrameWatch:
    """Hold the last images, the one since when nothing has moved in them, and the last verdict."""

    def __init__(self) -> None:
        self._before: tuple[RgbdFrame, ...] = ()
        self._still: tuple[Glance, Travel] | None = None
        self._repeats = Repeats(STALE_COLOUR_RATIO)
        self._came_ns: int | None = None
        self._verdict = ImageVerdict(use=ImageUse.ALL, faults=())
        self._refused = 0

    def came(self, frame: RgbdFrame, now_ns: int) -> None:
        """Take note that an image has come: the next one may be torn with it, judged or not."""
        self._came_ns = now_ns
        self._before = (*self._before[-2:], frame)

    def judge(
        self, frame: RgbdFrame, depth_m: Floats, rotation: NDArray[np.float64], base: Pose2D
    ) -> ImageVerdict:
        """Return what an image is good for.

        `rotation` is the camera's, 3 x 3, and `base` the robot's pose, in a frame without jumps.
        """
        glance = Glance.of(frame)
        stand = CameraStand(stamp_ns=frame.stamp_ns, rotation=rotation, base=base)
        seen = replace(
            measure_frame(frame.rgb, depth_m),
            stale_ratio=max(
                (glance.stale_ratio(one.depth) for one in self._before if one is not frame),
                default=0.0,
            ),
            stale_colour_ratio=self._repeats.ratio(glance, stand),
            unmoved_rad=self._unmoved_rad(glance, stand),
        )
        self._verdict = judge_frame(seen)
        self._refused += self._verdict.use is ImageUse.NOTHING
        return self._verdict

    def document(self, now_ns: int) -> dict[str, Any]:
        """Return the verdict on the last image, or that none comes, as the scene topic tells it."""
        if self._came_ns is None:
            self._came_ns = now_ns
        silence = judge_frame(FrameStatistics(silent_s=(now_ns - self._came_ns) / NS_PER_S))
        verdict = silence if silence.faults else self._verdict
        return {**verdict.document(), "refused": self._refused}

    def _unmoved_rad(self, glance: Glance, stand: CameraStand) -> float:
        if self._still is None or not glance.shows_the_same(self._still[0]):
            self._still = (glance, Travel(stand))
            return 0.0
        return self._still[1].rad(stand)
