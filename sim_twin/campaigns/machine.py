"""Run a robot's machine by itself, so that it outlives every process of the robot."""

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any, Final

from drivers.clock import NS_PER_S, MonotonicClock
from drivers.twin_clock import TwinClock
from drivers.twin_page import TwinPace
from sim_twin.errors import TwinError, TwinUnreachable
from sim_twin.process import READY_FILE
from sim_twin.referee import ask, told_hazards

_READY_S: Final = 90.0
_END_S: Final = 10.0
_POLL_NS: Final = NS_PER_S // 20


class Machine:
    """Own the process of one twin; the robot finds its devices in `devices_dir`."""

    def __init__(self, folder: Path, *, robot: str, seed: int) -> None:
        """Start the twin and return when it serves every device.

        Raises:
            TwinError: it ended, or is not ready in time.
        """
        self.folder = folder
        self._started_by = MonotonicClock()  # until there is a twin whose time could be told
        command = ["-m", "sim_twin", "--robot", robot, "--seed", str(seed), "--pace", TwinPace.REAL]
        command += ["--run-dir", str(folder), "--parent-pid", str(os.getpid())]
        self._process = subprocess.Popen([sys.executable, *command], start_new_session=True)
        try:
            self._wait_until_ready()
        except BaseException:
            self.close()
            raise
        self.clock = TwinClock(self.devices_dir)
        """The twin's time, by which the robot lives, too."""

    @property
    def devices_dir(self) -> Path:
        """Return where the devices are."""
        return self.folder / "dev"

    def truth(self) -> dict[str, Any]:
        """Return what the physics knows."""
        return ask(self.folder, "truth")

    def begin_watch(self) -> None:
        """Forget the hazards seen so far."""
        ask(self.folder, "hazards", begin="yes")

    def hazards(self) -> tuple[str, ...]:
        """Return the hazards since the watch began, in words."""
        return told_hazards(self.folder)

    def close(self) -> None:
        """End the twin; ending twice is allowed."""
        if self._process.poll() is None:
            self._process.terminate()
        self._process.wait(_END_S)

    def _wait_until_ready(self) -> None:
        deadline_ns = self._started_by.now_ns() + round(_READY_S * NS_PER_S)
        while not self._is_ready():
            if self._process.poll() is not None:
                raise TwinError(f"the twin ended with exit code {self._process.returncode}")
            if self._started_by.now_ns() > deadline_ns:
                raise TwinError(f"the twin under {self.folder} is not ready after {_READY_S:g} s")
            self._started_by.sleep_until(self._started_by.now_ns() + _POLL_NS)

    def _is_ready(self) -> bool:
        path = self.devices_dir / READY_FILE
        if not path.is_file():
            return False
        try:
            self.truth()
        except TwinUnreachable:
            return False
        return bool(json.loads(path.read_text(encoding="utf-8")))
