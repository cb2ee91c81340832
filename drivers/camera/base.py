"""Declare what every camera gives: the newest image, stamped with the time of its exposure."""

from dataclasses import dataclass
from enum import Enum
from typing import Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from drivers.camera.protocol import Intrinsics

Image = NDArray[np.uint8]


class StampSource(Enum):
    """Say what a stamp rests on."""

    DEVICE = "the device's own stamp, mapped to the host's clock"
    BUFFER = "the kernel's stamp of the buffer"
    ARRIVAL = "the time of arrival less the declared latency"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ColourFrame:
    """Hold one colour image; `stamp_ns` is the host's time of exposure."""

    stamp_ns: int
    sequence: int
    stamp_source: StampSource
    rgb: Image


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RgbdFrame:
    """Hold one colour and depth image with its calibration; `stamp_ns` is host time of exposure."""

    stamp_ns: int
    sequence: int
    intrinsics: Intrinsics
    depth_unit_m: float
    rgb: Image
    depth: NDArray[np.uint16]
    stamp_source: StampSource = StampSource.DEVICE

    def depth_m(self) -> NDArray[np.float32]:
        """Return depth along the optical axis in metres; 0 is no depth."""
        return self.depth.astype(np.float32) * np.float32(self.depth_unit_m)


@dataclass(slots=True)
class CameraCounters:
    """Count what the camera delivered and what was thrown away."""

    frames: int = 0
    superseded_frames: int = 0
    lost_frames: int = 0
    repeated_frames: int = 0
    crc_errors: int = 0
    discarded_bytes: int = 0
    restarts: int = 0
    arrival_stamps: int = 0


FrameT_co = TypeVar("FrameT_co", ColourFrame, RgbdFrame, covariant=True)


class Camera(Protocol[FrameT_co]):
    """Be one open, streaming camera; after LinkLost close it and open another."""

    counters: CameraCounters

    def poll(self) -> FrameT_co | None:
        """Return the newest frame completed since the last call, or None; never waits.

        Raises:
            LinkLost: the camera has gone.
        """
        ...

    def close(self) -> None:
        """Release the device; closing twice is allowed."""
        ...
