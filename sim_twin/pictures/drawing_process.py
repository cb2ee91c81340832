"""Begin and end a process that only draws what a mirror tells: the camera's, and the window's."""

import argparse
import signal
import socket
from collections.abc import Callable
from typing import Protocol

import mujoco

from sim_twin.errors import TwinError
from sim_twin.lifetime import die_with_parent
from sim_twin.physics.lamps import show_lamps
from sim_twin.pictures.mirror import READY, MirrorState


class Drawing(Protocol):
    """Draw every newest state."""

    def run(self, mirror: socket.socket) -> None:
        """Draw until the mirror's other end closes."""
        ...

    def close(self) -> None:
        """Release what draws."""
        ...


def drawing_parser(module: str) -> argparse.ArgumentParser:
    """Return a parser of what every drawing process is told."""
    parser = argparse.ArgumentParser(prog=f"python -m sim_twin.{module}")
    parser.add_argument("--robot", required=True)
    parser.add_argument("--world", required=True)
    parser.add_argument("--mirror-fd", type=int, required=True)
    parser.add_argument("--parent-pid", type=int, required=True)
    return parser


def run_drawing(options: argparse.Namespace, start: Callable[[], Drawing]) -> int:
    """Draw until the parent ends; tell it when that begins, or return 2 and tell why it cannot."""
    die_with_parent(options.parent_pid, signal.SIGKILL)
    # Both may reach the whole group; the twin ends this process by closing the mirror.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    mirror = socket.socket(fileno=options.mirror_fd)
    try:
        drawing = start()
    except TwinError as error:
        mirror.send(str(error).encode())
        return 2
    mirror.send(READY)
    try:
        drawing.run(mirror)
    finally:
        drawing.close()
    return 0


def take_over(state: MirrorState, model: mujoco.MjModel, data: mujoco.MjData) -> None:
    """Move everything that is drawn to where the state has it, and let the lamps shine."""
    data.qpos[:] = state.qpos
    show_lamps(model, state.switched_on)
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    mujoco.mj_camlight(model, data)
