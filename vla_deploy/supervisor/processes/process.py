"""Start, signal and reap one child process, with everything it started itself."""

import contextlib
import ctypes
import os
import signal
import subprocess
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

_LAUNCH = str(Path(__file__).with_name("launch.py"))


class ChildProcess:
    """Run one Python command in its own session, its output in a file.

    It gets SIGTERM from the kernel when the supervisor ends, however that ends, and has its nice
    before it loads anything.
    """

    def __init__(
        self,
        command: Sequence[str],
        environment: Mapping[str, str],
        output_path: Path,
        nice: int = 0,
        python: str = sys.executable,
    ) -> None:
        output_path.parent.mkdir(parents=True, exist_ok=True)
        with output_path.open("ab") as output:
            self._popen = subprocess.Popen(
                [
                    sys.executable,
                    "-I",
                    "-S",
                    _LAUNCH,
                    str(os.getpid()),
                    str(nice),
                    python,
                    *command,
                ],
                env=environment,
                stdin=subprocess.DEVNULL,
                stdout=output,
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
        if self._is_unreaped():
            os.kill(self.pid, signal.SIGTERM)

    def abort(self) -> None:
        """End a child with a traceback; one that is stopped is continued for that.

        The signal goes to its main thread, which handles it first. Any other thread could take a
        signal of the process, and would read frames that change.
        """
        if self._is_unreaped():
            ctypes.CDLL(None).tgkill(self.pid, self.pid, int(signal.SIGABRT))
            os.kill(self.pid, signal.SIGCONT)

    def kill(self) -> None:
        """End the child and its group at once."""
        if self._is_unreaped():
            self._signal_group(signal.SIGKILL)

    def _is_unreaped(self) -> bool:
        """Return whether the process id is still the child's own; looking further would reap it."""
        return self._popen.returncode is None

    def _signal_group(self, number: int) -> None:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(self.pid, number)
