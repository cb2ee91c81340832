"""Be the robot's RGB-D camera: renders the head's view when a frame is due."""

import math
from collections.abc import Callable

import mujoco
import numpy as np
from numpy.typing import NDArray

from drivers.camera.protocol import (
    BYTES_PER_PIXEL,
    CRC,
    HEADER_BYTES,
    CameraCommand,
    encode_request,
)
from sim_twin.errors import TwinModelMismatch
from sim_twin.faults.line_tamper import LineTamper
from sim_twin.pictures.renderer import Renderer, fixed_camera
from sim_twin.sensors.camera import CameraDevice
from vla_deploy.robots.camera import CameraDescription

_FOVY_TOLERANCE_RAD = 1e-3


class HeadCamera:
    """Render from the MJCF camera named as the robot file's optical site; GL opens at first use."""

    def __init__(
        self,
        model: mujoco.MjModel,
        data: mujoco.MjData,
        camera: CameraDescription,
        seed: int,
        *,
        latency_s: float = 0.0,
    ) -> None:
        """Check the calibration and prepare the device.

        Raises:
            ModelMismatch: the MJCF has no such camera, or its field of view is another.
        """
        self._model = model
        self._data = data
        self._camera = camera
        self._view = fixed_camera(model, camera.site)
        self._renderer: Renderer | None = None
        _check_fovy(model, camera)
        self.device = CameraDevice(
            self.render,
            camera.pinhole,
            latency_s=latency_s,
            seed=seed,
            has_depth=camera.has_depth,
        )

    def open(self) -> None:
        """Open OpenGL now rather than at the first frame.

        Raises:
            OpenGLMissing: nothing can be rendered on this machine.
        """
        if self._renderer is None:
            self._renderer = Renderer(self._model, self._camera.width, self._camera.height)

    def render(self) -> tuple[NDArray[np.uint8], NDArray[np.float32]]:
        """Return RGB and depth in metres of the present state.

        Raises:
            OpenGLMissing: nothing can be rendered on this machine.
        """
        self.open()
        assert self._renderer is not None
        return self._renderer.render(self._data, self._view)

    def hang_up(self) -> None:
        """Stop streaming because the client has gone."""
        self.device.receive(encode_request(CameraCommand.STOP, 0.0))

    def close(self) -> None:
        """Release OpenGL."""
        if self._renderer is not None:
            self._renderer.close()
            self._renderer = None


def camera_line(
    head: HeadCamera, camera: CameraDescription, now_ns: Callable[[], int]
) -> LineTamper:
    """Return the camera's line, on which faults may act."""
    frame_bytes = HEADER_BYTES + camera.width * camera.height * BYTES_PER_PIXEL + CRC.size
    return LineTamper(head.device, now_ns, frame_bytes, tells_time=False)


def _check_fovy(model: mujoco.MjModel, camera: CameraDescription) -> None:
    fovy_rad = math.radians(float(model.camera(camera.site).fovy[0]))
    if abs(fovy_rad - camera.fovy_rad) > _FOVY_TOLERANCE_RAD:
        raise TwinModelMismatch(
            f"camera {camera.site!r}: robot file says fovy_rad = {camera.fovy_rad:.4f}, "
            f"its MJCF {fovy_rad:.4f}; make them agree"
        )
