"""Show the twin in a window, in a process of its own, so that drawing never holds up the physics.

The window mirrors the positions; closing it leaves the twin running.
"""

import select
import socket
import sys
import threading
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import mujoco

from sim_twin.errors import DrawingFailed
from sim_twin.physics.compose import ROBOT_ROOT
from sim_twin.physics.load import load_model
from sim_twin.pictures.drawing_process import drawing_parser, run_drawing, take_over
from sim_twin.pictures.mirror import newest_state
from sim_twin.pictures.renderer import VISIBLE_GROUPS
from vla_deploy.robots import load_robot

_IDLE_S = 0.2
_CLOSE_S = 1.0
_DISTANCE_M = 3.0
_AZIMUTH_DEG, _ELEVATION_DEG = 140.0, -30.0


class Window(Protocol):
    """Draw a model's state."""

    def is_running(self) -> bool:
        """Return whether the window is still open."""
        ...

    def sync(self) -> None:
        """Take over the present state."""
        ...

    def close(self) -> None:
        """Close the window."""
        ...


class PassiveViewer:
    """Be MuJoCo's own viewer, which draws in a thread; it follows the robot."""

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData) -> None:
        """Open the window.

        Raises:
            DrawingFailed: GLFW is not installed, or does not reach the display.
        """
        viewer = _import_viewer()
        before = set(threading.enumerate())
        self._handle: Any = viewer.launch_passive(
            model, data, show_left_ui=False, show_right_ui=False
        )
        self._threads = set(threading.enumerate()) - before
        with self._handle.lock():
            self._handle.opt.geomgroup[:] = VISIBLE_GROUPS
            camera = self._handle.cam
            camera.type = mujoco.mjtCamera.mjCAMERA_TRACKING.value
            camera.trackbodyid = model.body(ROBOT_ROOT).id
            camera.distance = _DISTANCE_M
            camera.azimuth, camera.elevation = _AZIMUTH_DEG, _ELEVATION_DEG

    def is_running(self) -> bool:
        """Return whether the window is still open."""
        return bool(self._handle.is_running())

    def sync(self) -> None:
        """Take over the present state."""
        self._handle.sync()

    def close(self) -> None:
        """Close the window, and wait until its thread draws no more."""
        self._handle.close()
        for thread in self._threads:
            thread.join(_CLOSE_S)


def _import_viewer() -> Any:
    """Import what draws, late: nobody else needs a display.

    GLFW is asked first, since a refusal in the viewer's own thread would leave us waiting for ever.
    """
    try:
        import glfw
        import mujoco.viewer
    except ImportError as error:
        raise DrawingFailed(f"no window: {error}; pip install 'mujoco-core[rendering]'") from error
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", glfw.GLFWError)
        if not glfw.init():
            raise DrawingFailed("no window: the display cannot be reached; see DISPLAY and xhost")
    return mujoco.viewer


def show(window: Window, model: mujoco.MjModel, data: mujoco.MjData, mirror: socket.socket) -> None:
    """Draw every newest state until the window, or the mirror's other end, closes."""
    while window.is_running():
        select.select([mirror], [], [], _IDLE_S)
        try:
            state = newest_state(mirror)
        except EOFError:
            return
        if state is not None:
            data.time = state.now_ns * 1e-9
            take_over(state, model, data)
            window.sync()


@dataclass(frozen=True, slots=True)
class _Exhibit:
    """Hold a window and what it shows."""

    window: Window
    model: mujoco.MjModel
    data: mujoco.MjData

    def run(self, mirror: socket.socket) -> None:
        """Show it until the window, or the mirror's other end, closes."""
        show(self.window, self.model, self.data, mirror)

    def close(self) -> None:
        """Close the window."""
        self.window.close()


def _open_exhibit(robot: str, world: str) -> _Exhibit:
    model = load_model(load_robot(robot), world)
    data = mujoco.MjData(model)
    return _Exhibit(PassiveViewer(model, data), model, data)


def main(argv: Sequence[str] | None = None) -> int:
    """Run the window until its parent ends or somebody closes it; 2 when it cannot open."""
    told = drawing_parser("viewer_process").parse_args(argv)
    return run_drawing(told, lambda: _open_exhibit(told.robot, told.world))


if __name__ == "__main__":
    sys.exit(main())
