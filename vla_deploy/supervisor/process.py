"""Start, signal and reap one child process, with everything it started itself."""

import contextlib
import os
import signal
import subprocess
import sys
from collections import deque
from collections.abc import Mapping, Sequence
from pathlib import Path

_LAUNCH = str(Path(__file__).with_name("launch.py"))


class ChildProcess:
    """Run one Python command in its own session, its output in a log file.

    It gets SIGTERM from the kernel when the supervisor ends, however that ends.
    """

    def __init__(
        self, command: Sequence[str], environment: Mapping[str, str], log_path: Path
    ) -> None:
        log_path.parent.mkdir(parents=True, exist_ok=True)
        with log_path.open("ab") as log:
            self._popen = subprocess.Popen(
                [sys.executable, "-I", "-S", _LAUNCH, str(os.getpid()), *command],
                env=environment,
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=subprocess.STDOUT,
                start_new_session=True,
            )

    @property
    def pid(self) -> int:
        """Return the process id, which is also its process group's."""
        return self._popen.pid

    def exit_code(self) -> int | None:
        """Reap an ended child and kill what it left in its group; None while it runs."""
        if self._popen.returncode is None:
            flags = os.WEXITED | os.WNOHANG | os.WNOWAIT
            if os.waitid(os.P_PID, self.pid, flags) is None:
                return None
            self._signal_group(signal.SIGKILL)  # before reaping: the pid is still its own
        return self._popen.wait()

    def terminate(self) -> None:
        """Ask the child to stop in order."""
        self._popen.terminate()

    def kill(self) -> None:
        """End the child and its group at once."""
        if self._popen.returncode is None:
            self._signal_group(signal.SIGKILL)

    def _signal_group(self, number: int) -> None:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(self.pid, number)


def last_lines(log_path: Path, count: int) -> list[str]:
    """Return the last lines of a log file, none when there is no such file."""
    if not log_path.is_file():
        return []
    with log_path.open(errors="replace") as log:
        return [line.rstrip() for line in deque(log, maxlen=count)]
