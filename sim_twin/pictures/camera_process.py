"""Render in a process of its own, so that drawing a frame never holds up physics or buses.

It mirrors the physics' positions, serves the RGB-D camera's stream and shoots the film. On the
twin's time it is a member: a frame leaves `LATENCY_NS` after its exposure, however long it took to
draw, and time goes on meanwhile.
"""

import contextlib
import os
import select
import socket
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Final

import mujoco

from drivers.clock import NS_PER_S
from drivers.twin_clock import TimeLine
from drivers.twin_page import DEFAULT_HOLD, PAGE_FILE, Op, TimePage, TimeRole
from sim_twin.faults.camera_relay import CameraBench, CameraFaults
from sim_twin.physics.load import load_model
from sim_twin.pictures.drawing_process import drawing_parser, run_drawing, take_over
from sim_twin.pictures.film_server import FilmServer
from sim_twin.pictures.head_camera import HeadCamera, camera_line
from sim_twin.pictures.mirror import MirrorState, newest_state
from sim_twin.pictures.mirror_link import PERIOD_NS
from sim_twin.ports.json_line_server import JsonLineServer
from sim_twin.ports.stream_line import StreamLine
from sim_twin.referee import FILM_SOCKET
from vla_deploy.robots import load_robot

LATENCY_NS: Final = 40_000_000
"""From exposure to the first byte, as depth cameras need it (D435: some 40 ms at 30 Hz)."""
_FILM_HOLD_NS: Final = 100_000_000
_REST_NS: Final = 1_000_000
"""How soon the rest of a frame follows that has not found room at once."""
_ROLE: Final = TimeRole(name="camera", order=-1)
_IDLE_S: Final = 0.5


class Studio:
    """Draw what the mirror shows, for the camera's client and for the film."""

    def __init__(
        self, robot_name: str, world: str, seed: int, devices_dir: Path, *, is_member: bool
    ) -> None:
        """Open OpenGL and serve the sockets; `is_member`: the twin's time waits for the camera.

        Raises:
            TwinError: the model does not load, or nothing can be rendered here.
        """
        robot = load_robot(robot_name)
        self._model = load_model(robot, world)
        self._data = mujoco.MjData(self._model)
        latency_ns = LATENCY_NS if is_member else 0
        self._camera = HeadCamera(
            self._model, self._data, robot.camera, seed, latency_s=latency_ns / NS_PER_S
        )
        self._devices_dir = devices_dir
        self._is_member = is_member
        self._line: TimeLine | None = None
        self._camera.open()
        self._shown_ns = 0
        line = camera_line(self._camera, robot.camera, lambda: self._shown_ns)
        self._stream = StreamLine(line, devices_dir / robot.camera.device, self._camera.hang_up)
        bench = CameraBench(robot, self._camera, line, lambda: self._shown_ns)
        bench.plugs[robot.camera.device].add_socket(self._stream)
        self._faults = CameraFaults(bench)
        self._film = FilmServer(self._model, self._data, camera=robot.camera.site)
        self._film_requests = JsonLineServer(devices_dir / FILM_SOCKET, self._film.answer)

    def run(self, mirror: socket.socket) -> None:
        """Serve until the mirror's other end closes."""
        with contextlib.suppress(EOFError):
            if self._is_member:
                self._run_as_member(mirror)
            else:
                self._run_on_wall_clock(mirror)

    def _run_on_wall_clock(self, mirror: socket.socket) -> None:
        while True:
            readable = [mirror.fileno(), *self._stream.filenos(), *self._film_requests.filenos()]
            select.select(readable, self._stream.output_filenos(), [], _IDLE_S)
            self._stream.poll_once()
            self._film_requests.poll_once()
            state = newest_state(mirror)
            if state is not None:
                self._show(state)

    def _run_as_member(self, mirror: socket.socket) -> None:
        """Take part in the time of the twin that shows states, anew where it took time over."""
        while True:
            select.select([mirror], [], [])  # the twin moves time before it shows anything
            state = newest_state(mirror)
            page = TimePage(self._devices_dir / PAGE_FILE)
            if state is not None and page.is_governed:
                self._line = TimeLine(page, self._devices_dir)
                self._line.send(Op.JOIN, os.getpid(), role=_ROLE)
                self._follow(mirror, state, page, self._line)

    def _follow(
        self, mirror: socket.socket, state: MirrorState | None, page: TimePage, line: TimeLine
    ) -> None:
        shown_ns = page.now_ns()
        while line.is_current:
            if state is not None:
                shown_ns = state.clock_ns
                self._show(state)
            self._stream.poll_once()
            self._wait(line, self._next_ns(shown_ns, page.now_ns()))
            state = newest_state(mirror)

    def _next_ns(self, shown_ns: int, now_ns: int) -> int:
        """Return when the next state comes, or the rest of a frame may find room."""
        if self._stream.is_backed_up:
            return now_ns + _REST_NS
        periods = max(1, -((shown_ns - now_ns) // PERIOD_NS))
        return shown_ns + periods * PERIOD_NS

    def _wait(self, line: TimeLine, until_ns: int) -> None:
        """Wait in the twin's time; what is asked about the film meanwhile takes none."""
        line.send(Op.WAIT, until_ns, DEFAULT_HOLD)
        asked = [line.fileno(), *self._film_requests.filenos()]
        while line.fileno() not in select.select(asked, [], [])[0]:
            self._film_requests.poll_once()
            asked = [line.fileno(), *self._film_requests.filenos()]
        line.granted()

    def close(self) -> None:
        """Finish the film and take the sockets away."""
        self._film.close()
        self._film_requests.close()
        self._stream.close()
        self._camera.close()

    def _show(self, state: MirrorState) -> None:
        """Take over a state; the frame that is due is stamped with its time."""
        self._shown_ns = state.clock_ns
        self._faults.follow(state.camera_faults)
        take_over(state, self._model, self._data)
        device = self._camera.device
        if not self._stream.is_backed_up:
            if device.is_due(state.clock_ns):
                self._hold_until(state.clock_ns + LATENCY_NS)
            device.step(state.clock_ns)
        if self._film.is_due(state.now_ns):
            until_ns = state.clock_ns + _FILM_HOLD_NS
            self._hold_until(min(until_ns, device.next_event_ns(until_ns)))
            self._film.shoot(state.now_ns)
        self._stream.poll_once()

    def _hold_until(self, until_ns: int) -> None:
        if self._line is not None:
            self._line.send(Op.HOLD, until_ns)


def main(argv: Sequence[str] | None = None) -> int:
    """Run the studio until its parent ends; 2 when it cannot start."""
    parser = drawing_parser("camera_process")
    parser.add_argument("--seed", type=int, required=True)
    parser.add_argument("--devices-dir", type=Path, required=True)
    parser.add_argument("--member", action="store_true", help="take part in the twin's time")
    given = parser.parse_args(argv)
    return run_drawing(
        given,
        lambda: Studio(
            given.robot, given.world, given.seed, given.devices_dir, is_member=given.member
        ),
    )


if __name__ == "__main__":
    sys.exit(main())
