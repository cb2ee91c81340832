"""Spoil what single servos answer: the faults of cables, adapters and firmware on one bus.

Everything that is drawn by chance comes from a seed, so that a run repeats bit by bit.
"""

from collections.abc import Callable
from enum import Enum
from random import Random
from typing import Final

from drivers.clock import NS_PER_S
from drivers.dynamixel.wire.codec import MAX_SERVO_ID

_MAX_NOISE_BYTES: Final = 6


class ReplySpoiler(Enum):
    """Name what can lastingly happen to the bytes of every reply of a servo."""

    CLASH = "two servos answer at once"
    GARBLE = "a byte is damaged"
    TRUNCATE = "the end is missing"
    DUPLICATE = "it is said twice"


def _clash(reply: bytes, random: Random) -> bytes:
    """Return two answers that drive the line at once: no byte is the one or the other's."""
    return bytes(byte & random.randrange(1, 255) for byte in reply)


def _garble(reply: bytes, random: Random) -> bytes:
    """Change one byte, which no check sum misses."""
    spoiled = bytearray(reply)
    spoiled[random.randrange(len(reply))] ^= random.randrange(1, 256)
    return bytes(spoiled)


def _truncate(reply: bytes, random: Random) -> bytes:
    return reply[: random.randrange(1, len(reply))]


def _duplicate(reply: bytes, _random: Random) -> bytes:
    return reply + reply


_SPOILERS: Final[dict[ReplySpoiler, Callable[[bytes, Random], bytes]]] = {
    ReplySpoiler.CLASH: _clash,
    ReplySpoiler.GARBLE: _garble,
    ReplySpoiler.TRUNCATE: _truncate,
    ReplySpoiler.DUPLICATE: _duplicate,
}


class WireFaults:
    """Hold the faults of every servo, by its row, and carry them out on its replies."""

    def __init__(self, max_servo_id: int = MAX_SERVO_ID) -> None:
        self._max_servo_id = max_servo_id
        self.corrupted: set[int] = set()
        self.aliases: dict[int, int] = {}
        self.frozen: dict[int, bytes] = {}
        self._spoilers: dict[int, dict[ReplySpoiler, Random]] = {}
        self._delays_ns: dict[int, int] = {}
        self._losses: dict[int, tuple[float, Random]] = {}
        self._noise: Random | None = None
        self._shared_ids: dict[int, Random] = {}

    @property
    def active(self) -> bool:
        """Return whether any reply is to be spoiled."""
        return bool(
            self.corrupted
            or self.aliases
            or self.frozen
            or self._spoilers
            or self._delays_ns
            or self._losses
            or self._shared_ids
            or self._noise
        )

    def set_spoiler(self, row: int, spoiler: ReplySpoiler, *, on: bool, seed: int = 0) -> None:
        """Begin or end to spoil every reply of a servo."""
        kinds = self._spoilers.setdefault(row, {})
        if on:
            kinds[spoiler] = Random(f"{seed} {row} {spoiler.name}")
        else:
            kinds.pop(spoiler, None)
        if not kinds:
            del self._spoilers[row]

    def set_delay(self, row: int, delay_s: float) -> None:
        """Let every reply of a servo come later by this time; 0 ends it.

        Raises:
            ValueError: the time is negative.
        """
        if delay_s < 0.0:
            raise ValueError(f"delay of a reply: expected 0 s or more, got {delay_s}")
        self._delays_ns.pop(row, None)
        if delay_s > 0.0:
            self._delays_ns[row] = round(delay_s * NS_PER_S)

    def set_loss(self, row: int, ratio: float, seed: int) -> None:
        """Lose this share of a servo's replies; 0 ends it.

        Raises:
            ValueError: the share is not within 0..1.
        """
        if not 0.0 <= ratio <= 1.0:
            raise ValueError(f"share of lost replies: expected 0..1, got {ratio}")
        self._losses.pop(row, None)
        if ratio > 0.0:
            self._losses[row] = ratio, Random(f"{seed} {row} loss")

    def set_noise(self, *, on: bool, seed: int) -> None:
        """Put random bytes before every reply on the bus."""
        self._noise = Random(f"{seed} noise") if on else None

    def share_ids(self, rows: set[int]) -> None:
        """Take over which servos have an id that another one has too."""
        self._shared_ids = {
            row: self._shared_ids.get(row) or Random(f"{row} shared") for row in rows
        }

    def set_alias(self, row: int, servo_id: int | None) -> None:
        """Let a servo answer under another id; None ends it.

        Raises:
            ValueError: no servo can have the id.
        """
        if servo_id is not None and not 0 <= servo_id <= self._max_servo_id:
            expected = f"0..{self._max_servo_id}"
            raise ValueError(f"id in replies: expected {expected}, got {servo_id}")
        self.aliases.pop(row, None)
        if servo_id is not None:
            self.aliases[row] = servo_id

    def late_ns(self, row: int) -> int:
        """Return by how much a servo's reply is late."""
        return self._delays_ns.get(row, 0)

    def spoil(self, row: int, reply: bytes) -> bytes:
        """Return what becomes of a servo's reply on the wire; b"" where it is lost."""
        if row in self._losses:
            ratio, random = self._losses[row]
            if random.random() < ratio:
                return b""
        if row in self.corrupted:
            self.corrupted.discard(row)
            reply = reply[:-1] + bytes([reply[-1] ^ 0xFF])
        if row in self._shared_ids:
            reply = _clash(reply, self._shared_ids[row])
        for spoiler, random in self._spoilers.get(row, {}).items():
            reply = _SPOILERS[spoiler](reply, random)
        return self._noise_before() + reply

    def _noise_before(self) -> bytes:
        if self._noise is None:
            return b""
        return self._noise.randbytes(self._noise.randrange(1, _MAX_NOISE_BYTES + 1))
