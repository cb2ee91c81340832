"""Hold a working robot with everything around it that can become too little."""

import contextlib
import json
import subprocess
import tempfile
from collections.abc import Iterator
from pathlib import Path
from types import TracebackType
from typing import Any, Final

from sim_twin.campaigns.pressing.clock_shift import CannotShift, ClockShift
from sim_twin.campaigns.talk import CommandTalk
from sim_twin.campaigns.working_robot import WorkingRobot
from vla_deploy.ipc import topics
from vla_deploy.runtime.state_dir import state_dir_of
from vla_deploy.supervisor.processes.crash_reports import crash_folder

COOL_C: Final = 45.0
_DISK: Final = "48m"
_CHUNK_BYTES: Final = 1 << 20
_TEMPERATURE: Final = "sys/class/thermal/thermal_zone0/temp"
_UNDER_VOLTAGE: Final = "sys/class/hwmon/hwmon0/oc1_event_cnt"
_BOARD: Final = {
    "sys/class/thermal/thermal_zone0/type": "cpu-thermal\n",
    "sys/class/thermal/thermal_zone0/trip_point_0_type": "critical\n",
    "sys/class/thermal/thermal_zone0/trip_point_0_temp": "104500\n",
    _TEMPERATURE: "45000\n",
    "sys/class/hwmon/hwmon0/name": "soctherm_oc\n",
    _UNDER_VOLTAGE: "0\n",
    "sys/class/hwmon/hwmon0/oc2_event_cnt": "0\n",
    "sys/class/hwmon/hwmon0/oc3_event_cnt": "0\n",
}
"""What a Jetson tells of its heat and its supply, in the places of JetPack 6."""
PROFILE: Final = """inherits = "desktop"
control_rate_hz = 125
executor_rate_hz = 25
ladder = [
  { action = "slow", process = "perception", ratio = 0.5 },
  { action = "suspend", process = "planner" },
  { action = "restart", process = "perception" },
  { action = "protective_stop" },
]
ladder_timing = { rise_s = 2.0, fall_s = 3.0, release_ratio = 0.9 }
[board]
cpu_count = 64
[budgets]
perception = { memory_mb = 600, cpu_ratio = 0.9 }
planner = { memory_mb = 300, cpu_ratio = 1.5 }
[budgets.total]
memory_mb = 4000
cpu_ratio = 64
temperature_c = 85.0
disk_free_mb = 8
"""
_NO_WISH: Final = {"memory_mb": 0, "busy_cores": 0}


class CannotPress(Exception):
    """Say why a trouble cannot be made on this computer."""


class PressedScene:
    """Own folder, board, disk, clock and robot of one case; use it as a context manager."""

    def __init__(self, seed: int, *, small_disk: bool, shifted_clock: bool) -> None:
        self._seed = seed
        self._wants = (small_disk, shifted_clock)
        self._closing = contextlib.ExitStack()

    def __enter__(self) -> "PressedScene":
        """Start the robot.

        Raises:
            CannotPress: the computer lacks what the case needs.
            RobotFailed: the robot does not come up.
        """
        small_disk, shifted_clock = self._wants
        with contextlib.ExitStack() as stack:
            name = stack.enter_context(tempfile.TemporaryDirectory(prefix="vla-pressure-"))
            self.folder = Path(name)
            self.disk.mkdir()
            if small_disk:
                stack.enter_context(_mounted(self.disk))
            self.shift = _shift(self.folder) if shifted_clock else None
            self.wish()
            self.lay_out_board()
            self.robot = self._start()
            stack.callback(self.robot.close)
            self.talk: CommandTalk = self.robot.talk()
            self._closing = stack.pop_all()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._closing.close()

    def wish(self, **usage: int) -> None:
        """Let the hog use that much from now on."""
        fresh = self.folder / "wish.new"
        fresh.write_text(json.dumps({**_NO_WISH, **usage}), encoding="utf-8")
        fresh.replace(self.folder / "wish.json")

    def heat(self, degrees_c: float) -> None:
        """Let the board have that temperature."""
        self._rewrite(_TEMPERATURE, round(1000 * degrees_c))

    def brown_out(self) -> None:
        """Let the board count one more under-voltage."""
        self._rewrite(_UNDER_VOLTAGE, 1 + int((self.board / _UNDER_VOLTAGE).read_text()))

    def fill_disk(self) -> None:
        """Leave no byte free."""
        with (self.disk / "ballast").open("wb", buffering=0) as file:
            with contextlib.suppress(OSError):  # it ends when the disk is full, as it should
                while file.write(bytes(_CHUNK_BYTES)):
                    pass
            with contextlib.suppress(OSError):
                while file.write(bytes(512)):
                    pass

    def free_disk(self) -> None:
        """Take the ballast away."""
        (self.disk / "ballast").unlink()

    def shift_clock(self, seconds: int) -> None:
        """Let the wall clock of the robot's processes jump.

        Raises:
            CannotPress: one of them does not read the shifted clock.
        """
        assert self.shift is not None, "the case wants a shifted clock"
        blind = [name for name, pid in self.robot.pids().items() if not self.shift.is_in(pid)]
        if blind:
            raise CannotPress(f"{', '.join(blind)} cannot be given another clock")
        self.shift.set(seconds)

    def budget(self) -> dict[str, Any]:
        """Return the supervisor's word about budgets."""
        return self.robot.document(topics.BUDGET)

    def crashes(self) -> list[str]:
        """Return of which processes crash reports have been written."""
        reports = crash_folder(state_dir_of(self.robot.base)).entries()
        return [str(json.loads(report.read_text())["process"]) for report in reports]

    @property
    def disk(self) -> Path:
        """Return what holds the robot's runs and what outlives them."""
        return self.folder / "disk"

    @property
    def board(self) -> Path:
        """Return the root of what the robot's probes read."""
        return self.folder / "board"

    def lay_out_board(self) -> None:
        """Write what a cool board with a good supply tells; its disk is the robot's."""
        for name, content in _BOARD.items():
            path = self.board / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(content, encoding="utf-8")
        shown = self.board / self.disk.relative_to("/")
        shown.parent.mkdir(parents=True)
        shown.symlink_to(self.disk)

    def _rewrite(self, name: str, value: int) -> None:
        fresh = self.board / f"{name}.new"
        fresh.write_text(f"{value}\n", encoding="utf-8")
        fresh.replace(self.board / name)

    def _start(self) -> WorkingRobot:
        profile = self.folder / "pressed.toml"
        profile.write_text(PROFILE, encoding="utf-8")
        words = {
            "--profile": profile,
            "--probe-root": self.board,
            "--wish": self.folder / "wish.json",
            "--seed": self._seed,
        }
        return WorkingRobot(
            self.disk / "run",
            *(str(word) for pair in words.items() for word in pair),
            log=self.folder / "robot.log",
            environment=self.shift.environment if self.shift is not None else None,
        )


@contextlib.contextmanager
def _mounted(folder: Path) -> Iterator[None]:
    words = ("mount", "-t", "tmpfs", "-o", f"size={_DISK}", "tmpfs", str(folder))
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    if done.returncode:
        raise CannotPress(f"no small disk can be mounted: {done.stderr.strip()}")
    try:
        yield
    finally:
        subprocess.run(("umount", "--lazy", str(folder)), check=True)


def _shift(folder: Path) -> ClockShift:
    try:
        return ClockShift(folder)
    except CannotShift as error:
        raise CannotPress(str(error)) from error
