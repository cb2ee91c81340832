"""Give the images of a colour camera as frames whose depth is 0 everywhere: it measures none."""

import numpy as np

from drivers.camera.base import CameraCounters, RgbdFrame
from drivers.camera.capture import CaptureRequest
from drivers.camera.protocol import Intrinsics
from drivers.camera.v4l2 import VideoCamera
from drivers.clock import Clock

DEPTH_UNIT_M = 0.001


class ColourOnlyCamera:
    """Read the camera of a video device, with the lens of the robot file or of a calibration."""

    def __init__(self, source: str, clock: Clock, pinhole: Intrinsics) -> None:
        """Begin to open the device at the size of the lens; `poll` tells what became of it.

        The rate is the camera's own: webcams refuse most others.
        """
        request = CaptureRequest(source=source, width=pinhole.width, height=pinhole.height)
        self._camera = VideoCamera(request, clock)
        self._pinhole = pinhole
        self._no_depth = np.zeros((pinhole.height, pinhole.width), dtype="<u2")
        self._no_depth.flags.writeable = False

    @property
    def counters(self) -> CameraCounters:
        """Return what the camera delivered."""
        return self._camera.counters

    def poll(self) -> RgbdFrame | None:
        """Return the newest frame since the last call, or None; never waits.

        Raises:
            DeviceMissing: there is no such device.
            DeviceBusy: another process has the camera.
            WrongDevice: it delivers another size than asked for.
            LinkLost: the camera has gone, or was silent for 2 s.
        """
        frame = self._camera.poll()
        if frame is None:
            return None
        return RgbdFrame(
            stamp_ns=frame.stamp_ns,
            sequence=frame.sequence,
            stamp_source=frame.stamp_source,
            intrinsics=self._pinhole,
            depth_unit_m=DEPTH_UNIT_M,
            rgb=frame.rgb,
            depth=self._no_depth,
        )

    def close(self) -> None:
        """Release the device; closing twice is allowed."""
        self._camera.close()
