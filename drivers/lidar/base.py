"""Declare what every planar lidar gives: the newest whole turn, beam by beam, with its times."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

BEAMS = 360


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Scan:
    """Hold one turn of the lidar.

    Beam i lies i degrees counter-clockwise from the robot's front; range 0 is no return.
    `beam_stamp_ns` tells when each beam was measured, for taking out the robot's own motion.
    """

    stamp_ns: int
    range_m: NDArray[np.float32]
    beam_stamp_ns: NDArray[np.int64]
    turn_hz: float


@dataclass(slots=True)
class LidarCounters:
    """Count what the line delivered and what was thrown away."""

    packets: int = 0
    crc_errors: int = 0
    discarded_bytes: int = 0
    scans: int = 0
    incomplete_scans: int = 0


class Lidar(Protocol):
    """Be one open connection to a lidar; after LinkLost close it and open another."""

    counters: LidarCounters

    def poll(self) -> Scan | None:
        """Return the newest scan completed since the last call, or None; never waits.

        Raises:
            LinkLost: the line has gone.
        """
        ...

    def close(self) -> None:
        """Release the device; closing twice is allowed."""
        ...
