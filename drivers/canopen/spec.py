"""Declare what the robot file says about one wheel drive."""

import math
from dataclasses import dataclass
from typing import Final

from drivers.canopen.objects import DriveMode

HOST_NODE_ID: Final = 0x7F


@dataclass(frozen=True, slots=True, kw_only=True)
class DriveSpec:
    """Describe one drive; `sign` is -1 where its positive direction turns the joint backwards.

    `gear_ratio` is motor turns per joint turn behind the drive; `counts_per_rev` are the motor's.

    Raises:
        ValueError: a value is out of its range.
    """

    node_id: int
    joint: str
    sign: int = 1
    counts_per_rev: int = 16384
    gear_ratio: float = 1.0
    mode: DriveMode = DriveMode.PROFILE_VELOCITY
    acceleration_rad_s2: float = 20.0
    quick_stop_rad_s2: float = 40.0

    def __post_init__(self) -> None:
        checks = (
            ("node_id", 1 <= self.node_id < HOST_NODE_ID, "1..126 (127 is the host's)"),
            ("sign", self.sign in (-1, 1), "-1 or 1"),
            ("counts_per_rev", self.counts_per_rev > 0, "above 0"),
            ("gear_ratio", self.gear_ratio > 0.0, "above 0"),
            ("acceleration_rad_s2", self.acceleration_rad_s2 > 0.0, "above 0"),
            ("quick_stop_rad_s2", self.quick_stop_rad_s2 > 0.0, "above 0"),
        )
        for name, valid, allowed in checks:
            if not valid:
                raise ValueError(f"drive {self.joint}: {name} {getattr(self, name)}, not {allowed}")

    @property
    def name(self) -> str:
        """Return what the drive is called in messages."""
        return f"drive {self.joint} (node {self.node_id})"

    @property
    def counts_per_rad(self) -> float:
        """Return encoder counts per joint radian, with the sign of the mounting."""
        return self.sign * self.counts_per_rev * self.gear_ratio / math.tau
