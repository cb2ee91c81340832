"""Render in a process of its own, so that drawing a frame never holds up physics or buses.

It mirrors the physics' positions, serves the RGB-D camera's stream and shoots the film.
"""

import select
import socket
import sys
from collections.abc import Sequence
from pathlib import Path

import mujoco

from sim_twin.drawing_process import drawing_parser, run_drawing, take_over
from sim_twin.faults.camera_relay import CameraBench, CameraFaults
from sim_twin.film_desk import FilmDesk
from sim_twin.head_camera import HeadCamera, camera_line
from sim_twin.json_line_server import JsonLineServer
from sim_twin.load import load_model
from sim_twin.mirror import MirrorState, newest_state
from sim_twin.referee import FILM_SOCKET
from sim_twin.stream_line import StreamLine
from vla_deploy.robots import load_robot

_IDLE_S = 0.5


class Studio:
    """Draw what the mirror shows, for the camera's client and for the film."""

    def __init__(self, robot_name: str, world: str, seed: int, devices_dir: Path) -> None:
        """Open OpenGL and serve the sockets.

        Raises:
            TwinError: the model does not load, or nothing can be rendered here.
        """
        robot = load_robot(robot_name)
        self._model = load_model(robot, world)
        self._data = mujoco.MjData(self._model)
        self._camera = HeadCamera(self._model, self._data, robot.camera, seed)
        self._camera.open()
        self._shown_ns = 0
        line = camera_line(self._camera, robot.camera, lambda: self._shown_ns)
        self._stream = StreamLine(line, devices_dir / robot.camera.device, self._camera.hang_up)
        bench = CameraBench(robot, self._camera, line, lambda: self._shown_ns)
        bench.plugs[robot.camera.device].add_socket(self._stream)
        self._faults = CameraFaults(bench)
        self._desk = FilmDesk(self._model, self._data, camera=robot.camera.site)
        self._film_server = JsonLineServer(devices_dir / FILM_SOCKET, self._desk.answer)

    def run(self, mirror: socket.socket) -> None:
        """Serve until the mirror's other end closes."""
        while True:
            self._wait(mirror)
            self._stream.poll_once()
            self._film_server.poll_once()
            try:
                state = newest_state(mirror)
            except EOFError:
                return
            if state is not None:
                self._show(state)

    def close(self) -> None:
        """Finish the film and take the sockets away."""
        self._desk.close()
        self._film_server.close()
        self._stream.close()
        self._camera.close()

    def _wait(self, mirror: socket.socket) -> None:
        readable = [mirror.fileno(), *self._stream.filenos(), *self._film_server.filenos()]
        select.select(readable, self._stream.output_filenos(), [], _IDLE_S)

    def _show(self, state: MirrorState) -> None:
        """Take over a state; stamp camera frames with wall time, which never slips."""
        self._shown_ns = state.wall_ns
        self._faults.follow(state.camera_faults)
        take_over(state, self._model, self._data)
        if not self._stream.is_backed_up:
            self._camera.device.step(state.wall_ns)
        self._desk.shoot_if_due(state.now_ns)
        self._stream.poll_once()


def main(argv: Sequence[str] | None = None) -> int:
    """Run the studio until its parent ends; 2 when it cannot start."""
    parser = drawing_parser("camera_process")
    parser.add_argument("--seed", type=int, required=True)
    parser.add_argument("--devices-dir", type=Path, required=True)
    told = parser.parse_args(argv)
    return run_drawing(told, lambda: Studio(told.robot, told.world, told.seed, told.devices_dir))


if __name__ == "__main__":
    sys.exit(main())
