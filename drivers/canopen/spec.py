"""Declare what the robot file says about one wheel drive, and what the driver tells about all."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drivers.canopen.cia402 import PowerState
from drivers.canopen.emergency import Emergency


@dataclass(frozen=True, slots=True, kw_only=True)
class DriveSpec:
    """Describe one drive; `sign` is -1 where its positive direction turns the joint backwards.

    Raises:
        ValueError: a value is out of its range.
    """

    node_id: int
    joint: str
    sign: int = 1
    counts_per_rev: int = 16384
    acceleration_rad_s2: float = 20.0
    quick_stop_rad_s2: float = 40.0

    def __post_init__(self) -> None:
        checks = (
            ("node_id", 1 <= self.node_id <= 127, "1..127"),
            ("sign", self.sign in (-1, 1), "-1 or 1"),
            ("counts_per_rev", self.counts_per_rev > 0, "above 0"),
            ("acceleration_rad_s2", self.acceleration_rad_s2 > 0.0, "above 0"),
            ("quick_stop_rad_s2", self.quick_stop_rad_s2 > 0.0, "above 0"),
        )
        for name, valid, allowed in checks:
            if not valid:
                raise ValueError(f"drive {self.joint}: {name} {getattr(self, name)}, not {allowed}")

    @property
    def counts_per_rad(self) -> float:
        """Return encoder counts per joint radian, with the sign of the mounting."""
        return self.sign * self.counts_per_rev / math.tau


@dataclass(frozen=True, slots=True, kw_only=True)
class DriveState:
    """Hold what is known of all drives at one tick, in the order of their specs.

    `age_s` is the time since the SYNC that sampled the values. `lost` marks a drive that has gone
    silent, left OPERATIONAL or rebooted; `faulted` one in a fault state; `emergency` is the latest
    emergency message that was not taken back.
    """

    position_rad: NDArray[np.float64]
    velocity_rad_s: NDArray[np.float64]
    torque_nm: NDArray[np.float64]
    age_s: NDArray[np.float64]
    power_state: tuple[PowerState, ...]
    lost: tuple[bool, ...]
    faulted: tuple[bool, ...]
    emergency: tuple[Emergency | None, ...]
    enabled: bool

    @property
    def healthy(self) -> bool:
        """Tell whether no drive is lost or faulted."""
        return not any(self.lost) and not any(self.faulted)
