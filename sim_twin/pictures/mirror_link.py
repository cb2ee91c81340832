"""Start a process that only draws, and keep its picture of the world up to date."""

import os
import select
import signal
import subprocess
import sys
from collections.abc import Mapping, Sequence

from sim_twin.errors import DrawingFailed
from sim_twin.pictures.mirror import READY, MirrorState, mirror_pair, send_state

START_TIMEOUT_S = 30.0
STOP_TIMEOUT_S = 2.5
PERIOD_NS = 20_000_000
_MESSAGE_BYTES = 4096


class MirrorLink:
    """Own a drawing process and the mirror that feeds it; it can never hold up the physics.

    `module` is run with `flags`, `arguments`, `--mirror-fd` and `--parent-pid`; `name` is for
    messages.
    """

    def __init__(
        self,
        name: str,
        module: str,
        arguments: Mapping[str, str],
        environment: Mapping[str, str] | None = None,
        flags: Sequence[str] = (),
    ) -> None:
        self._name = name
        self._sender, receiver = mirror_pair()
        self._due_ns = 0
        self.alive = True
        options = {
            **arguments,
            "--mirror-fd": str(receiver.fileno()),
            "--parent-pid": str(os.getpid()),
        }
        words = [*flags, *(word for pair in options.items() for word in pair)]
        with receiver:
            self._process = subprocess.Popen(
                [sys.executable, "-m", module, *words],
                pass_fds=[receiver.fileno()],
                env={**os.environ, **(environment or {})},
            )

    def wait_ready(self) -> None:
        """Wait until the process draws.

        Raises:
            DrawingFailed: the process refused to start, ended, or takes too long.
        """
        select.select([self._sender], [], [], START_TIMEOUT_S)
        try:
            told = self._sender.recv(_MESSAGE_BYTES)
        except BlockingIOError:
            raise DrawingFailed(
                f"the {self._name} was not ready within {START_TIMEOUT_S:g} s"
            ) from None
        if told != READY:
            raise DrawingFailed(told.decode() or f"the {self._name} ended, see its words above")

    def show(self, state: MirrorState) -> None:
        """Pass the state on every 20 ms of simulated time."""
        if not self.alive or state.now_ns < self._due_ns:
            return
        self._due_ns = state.now_ns + PERIOD_NS
        try:
            send_state(self._sender, state)
        except BrokenPipeError:
            self.alive = False
            sys.stderr.write(
                f"twin: the {self._name} has gone ({self._state()}); the rest goes on\n"
            )

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
