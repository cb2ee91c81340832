"""Declare the options of one run of the robot."""

import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from drivers.twin_page import TwinPace


@dataclass(frozen=True, slots=True, kw_only=True)
class RunOptions:
    """Choose robot, profile and world, "" for that of the robot file.

    `arm` arms the robot once everything is ready.
    `profile_fault` is why the profile is not the one that was chosen.
    `viewer` shows the twin in a window; `paced` gives the bytes on its buses their time; `pace`
    chooses its time.
    `ros` puts the robot into a ROS 2 graph, whatever its file and the profile say.
    `devices_dir` replaces the hardware by what is served there, as by a twin that runs by itself.
    `variables` are added to the environment of single processes; the run's log begins with `notes`.
    """

    robot: str = "butler"
    profile: str = "desktop"
    profile_fault: str = ""
    twin: bool = False
    viewer: bool = False
    paced: bool = False
    pace: TwinPace = TwinPace.REAL
    seed: int = 0
    world: str = ""
    devices_dir: Path | None = None
    runtime_base: Path | None = None
    arm: bool = False
    ros: bool = False
    probe_root: Path = Path("/")
    variables: Mapping[str, Mapping[str, str]] = field(default_factory=dict, repr=False)
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Refuse what only the twin can do."""
        if self.probe_root != Path("/") and not self.twin:
            raise ValueError(f"probe_root {self.probe_root}: expected / without the twin")

    @property
    def has_twin_time(self) -> bool:
        """Return whether the run lives on the twin's time."""
        return self.twin and self.pace is not TwinPace.WALL

    @property
    def takes_devices(self) -> bool:
        """Return whether device paths of the robot file are replaced."""
        return self.twin or self.devices_dir is not None

    def fill(self, command: tuple[str, ...], run_dir: Path) -> list[str]:
        """Replace the `{...}` of a table's command."""
        values = {
            "run_dir": run_dir,
            "robot": self.robot,
            "profile": self.profile,
            "world": self.world,
            "seed": self.seed,
            "pace": self.pace,
            "supervisor_pid": os.getpid(),
            "devices_dir": self.devices_dir or run_dir / "dev",
        }
        return [part.format_map(values) for part in command]
