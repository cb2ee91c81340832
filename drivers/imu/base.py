"""Declare what every inertial sensor gives: stamped samples, oldest first."""

from dataclasses import dataclass
from typing import Protocol


@dataclass(frozen=True, slots=True, kw_only=True)
class ImuSample:
    """Hold one inertial sample in the sensor's frame; yaw counts from the sensor's start."""

    stamp_ns: int
    index: int
    yaw_rad: float
    pitch_rad: float
    roll_rad: float
    acceleration_m_s2: tuple[float, float, float]


@dataclass(slots=True)
class ImuCounters:
    """Count what the line delivered and what was thrown away."""

    frames: int = 0
    checksum_errors: int = 0
    discarded_bytes: int = 0
    lost_frames: int = 0
    repeated_frames: int = 0


class Imu(Protocol):
    """Be one open connection to an inertial sensor; after LinkLost close it and open another."""

    counters: ImuCounters

    def poll(self) -> list[ImuSample]:
        """Return the samples that arrived since the last call, oldest first; never waits.

        Raises:
            LinkLost: the line has gone.
        """
        ...

    def close(self) -> None:
        """Release the device; closing twice is allowed."""
        ...
