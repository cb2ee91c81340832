"""Pack what a person says into a browser's microphone, as topic `page_sound` carries it.

A turn is what is said while a button is held. It has a number of its own, and ends by being let go
or by being cut off, which leaves the phrase under way unheard.
"""

import struct
from dataclasses import dataclass, field
from enum import IntEnum
from typing import Final

import numpy as np
from numpy.typing import NDArray

from vla_deploy.ipc.errors import BadPayload

Samples = NDArray[np.int16]
RATES_HZ: Final = (16_000, 48_000)
_HEAD: Final = struct.Struct("<III")
NOTHING: Final[Samples] = np.zeros(0, np.int16)


class SoundStep(IntEnum):
    """Say what a record tells of a turn."""

    SOUND = 0
    ENDED = 1
    CUT = 2


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PageSound:
    """Hold a step of a turn, and the samples of one channel that come with it."""

    turn: int
    rate_hz: int
    step: SoundStep
    samples: Samples = field(default_factory=lambda: NOTHING)

    def packed(self) -> bytes:
        """Return the record."""
        head = _HEAD.pack(self.turn, self.rate_hz, self.step)
        return head + self.samples.astype("<i2").tobytes()


def unpacked(payload: bytes) -> PageSound:
    """Return what a record holds.

    Raises:
        BadPayload: it was not packed by `PageSound`.
    """
    body = payload[_HEAD.size :]
    if len(payload) < _HEAD.size or len(body) % 2:
        raise BadPayload(f"page_sound: {len(payload)} bytes are no whole record")
    turn, rate_hz, step = _HEAD.unpack_from(payload)
    if rate_hz not in RATES_HZ or step not in list(SoundStep):
        raise BadPayload(f"page_sound: rate {rate_hz} Hz, step {step}: of another release?")
    samples = np.frombuffer(body, "<i2").astype(np.int16)
    return PageSound(turn=turn, rate_hz=rate_hz, step=SoundStep(step), samples=samples)
