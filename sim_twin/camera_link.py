"""Start the rendering process and keep its picture of the world up to date."""

import os
import select
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sim_twin.camera_process import READY
from sim_twin.errors import CameraFailed
from sim_twin.mirror import MirrorState, mirror_pair, send_state

START_TIMEOUT_S = 30.0
STOP_TIMEOUT_S = 2.5
PERIOD_NS = 20_000_000
_MESSAGE_BYTES = 4096


class CameraLink:
    """Own the rendering process and the mirror that feeds it."""

    def __init__(self, robot: str, world: str, seed: int, devices_dir: Path) -> None:
        self._sender, receiver = mirror_pair()
        self._due_ns = 0
        self.alive = True
        arguments = {
            "--robot": robot,
            "--world": world,
            "--seed": str(seed),
            "--devices-dir": str(devices_dir),
            "--mirror-fd": str(receiver.fileno()),
            "--parent-pid": str(os.getpid()),
        }
        words = [word for pair in arguments.items() for word in pair]
        with receiver:
            self._process = subprocess.Popen(
                [sys.executable, "-m", "sim_twin.camera_process", *words],
                pass_fds=[receiver.fileno()],
                # One llvmpipe thread draws as fast as two and leaves the other core to the robot.
                env={**os.environ, "LP_NUM_THREADS": "1"},
            )

    def wait_ready(self) -> None:
        """Wait until the camera is served.

        Raises:
            CameraFailed: the process refused to start, ended, or takes too long.
        """
        select.select([self._sender], [], [], START_TIMEOUT_S)
        try:
            told = self._sender.recv(_MESSAGE_BYTES)
        except BlockingIOError:
            raise CameraFailed(
                f"the rendering process was not ready within {START_TIMEOUT_S:g} s"
            ) from None
        if told != READY:
            raise CameraFailed(told.decode() or "the rendering process ended, see its words above")

    def show(self, now_ns: int, wall_ns: int, qpos: NDArray[np.float64]) -> None:
        """Pass the state on every 20 ms of simulated time."""
        if not self.alive or now_ns < self._due_ns:
            return
        self._due_ns = now_ns + PERIOD_NS
        try:
            send_state(self._sender, MirrorState(now_ns=now_ns, wall_ns=wall_ns, qpos=qpos))
        except BrokenPipeError:
            self.alive = False
            sys.stderr.write(f"twin: the camera has gone ({self._state()}); the rest goes on\n")

    def close(self) -> None:
        """End the process in order, so that a film is finished; kill it where it hangs."""
        self._sender.close()
        try:
            self._process.wait(STOP_TIMEOUT_S)
        except subprocess.TimeoutExpired:
            self._process.send_signal(signal.SIGKILL)
            self._process.wait()

    def _state(self) -> str:
        code = self._process.poll()
        return "still running" if code is None else f"exit status {code}"
