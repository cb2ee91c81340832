"""Declare what a microphone gives and a speaker takes: stamped blocks of samples.

Samples are signed 16-bit integers, one row per moment, one column per channel.
"""

from dataclasses import dataclass
from typing import Final, Protocol

import numpy as np
from numpy.typing import NDArray

Samples = NDArray[np.int16]
FULL_SCALE: Final = 32_768.0


@dataclass(frozen=True, slots=True, kw_only=True)
class AudioFormat:
    """Say how fast and how wide the samples come."""

    rate_hz: int
    channels: int = 1

    def __post_init__(self) -> None:
        """Check the values.

        Raises:
            ValueError: the rate is not in 1000..192000, or the channels not in 1..32.
        """
        if not 1_000 <= self.rate_hz <= 192_000 or not 1 <= self.channels <= 32:
            raise ValueError(
                "audio: expected a rate in 1000..192000 Hz and 1..32 channels, got "
                f"{self.rate_hz} Hz and {self.channels}"
            )

    def duration_ns(self, count: int) -> int:
        """Return how long `count` rows last."""
        return count * 1_000_000_000 // self.rate_hz

    def __str__(self) -> str:
        return f"{self.rate_hz} Hz, {self.channels} channels"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class AudioBlock:
    """Hold samples that follow each other; `stamp_ns` is the host's time of the first one."""

    stamp_ns: int
    format: AudioFormat
    samples: Samples

    def ratio(self) -> NDArray[np.float32]:
        """Return the samples as a share of full scale, -1 to 1."""
        return self.samples.astype(np.float32) / np.float32(FULL_SCALE)


@dataclass(slots=True)
class AudioCounters:
    """Count rows of samples, what was lost of them, and blocks that came a second time."""

    samples: int = 0
    lost_samples: int = 0
    repeated_blocks: int = 0
    blocks: int = 0
    crc_errors: int = 0
    discarded_bytes: int = 0


class AudioInput(Protocol):
    """Be one open microphone; after LinkLost close it and open another."""

    format: AudioFormat
    counters: AudioCounters

    def poll(self) -> AudioBlock | None:
        """Return the samples since the last call as one block, or None; never waits.

        Raises:
            LinkLost: the device has gone.
        """
        ...

    def close(self) -> None:
        """Release the device; closing twice is allowed."""
        ...


class AudioOutput(Protocol):
    """Be one open speaker; after LinkLost close it and open another."""

    format: AudioFormat
    counters: AudioCounters

    def write(self, samples: Samples) -> int:
        """Hand over what the device has room for and return how many rows that was; never waits.

        Raises:
            ValueError: the samples do not have the format's channels.
            LinkLost: the device has gone.
        """
        ...

    def close(self) -> None:
        """Release the device; closing twice is allowed."""
        ...


def check_samples(samples: Samples, format_: AudioFormat) -> None:
    """Refuse what a device of this format cannot take.

    Raises:
        ValueError: shape or kind is another one.
    """
    if samples.ndim != 2 or samples.shape[1] != format_.channels or samples.dtype != np.int16:
        raise ValueError(
            f"audio: expected int16 samples of shape (n, {format_.channels}), got "
            f"{samples.dtype} of shape {samples.shape}"
        )
