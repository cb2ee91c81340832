"""Sum up what passes between control and its buses: same sum, same bits at the same time."""

import hashlib
import struct
from collections.abc import Callable
from typing import Final

_TIME: Final = struct.Struct("<q")


class WireDigest:
    """Hash every byte of the servo bus, both ways, and every CAN frame of the host, with its time.

    Two runs with the same digest have shown control the same robot, and control has done the same.
    """

    def __init__(self, now_ns: Callable[[], int]) -> None:
        self._now_ns = now_ns
        self._hash = hashlib.blake2b(digest_size=8)
        self._last_ns = 0

    def add(self, data: bytes) -> None:
        """Add what passes now; in how many pieces it passes says nothing."""
        now_ns = self._now_ns()
        if now_ns != self._last_ns:
            self._last_ns = now_ns
            self._hash.update(_TIME.pack(now_ns))
        self._hash.update(data)

    def text(self) -> str:
        """Return the digest of all so far."""
        return self._hash.hexdigest()
