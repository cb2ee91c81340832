"""Switch a USB relay of the LCUS kind: a CH340 with a microcontroller, four bytes a command.

`A0 channel state sum`, at 9600 baud, state 1 to close; the board answers nothing. It stays as it
was told last: it is not fail-safe, whatever feeds it.
"""

from contextlib import suppress
from typing import Final

from drivers.base import ByteTransport
from drivers.clock import NS_PER_S, Clock
from drivers.errors import LinkLost

LCUS_BAUD: Final = 9600
LCUS_HEAD: Final = 0xA0
LCUS_BYTES: Final = 4
_REPEAT_NS: Final = NS_PER_S // 2
"""The board may be plugged in anew, and then it is open."""


class LcusRelay:
    """Close one channel while it is fed, and open it when it is cut."""

    def __init__(self, transport: ByteTransport, clock: Clock, channel: int) -> None:
        self._transport = transport
        self._clock = clock
        self._channel = channel
        self._fed_ns: int | None = None
        self._is_cut = False

    def feed(self) -> None:
        """Close the channel, again every half second.

        Raises:
            LinkLost: the adapter is gone.
        """
        now_ns = self._clock.now_ns()
        if self._fed_ns is None or now_ns - self._fed_ns >= _REPEAT_NS:
            self._transport.write(lcus_command(self._channel, closed=True))
            self._fed_ns, self._is_cut = now_ns, False

    def cut(self) -> None:
        """Open the channel.

        Raises:
            LinkLost: the adapter is gone; the channel stays as it is.
        """
        if not self._is_cut:
            self._transport.write(lcus_command(self._channel, closed=False))
            self._fed_ns, self._is_cut = None, True

    def close(self) -> None:
        """Open the channel and release the adapter; closing twice is allowed."""
        with suppress(LinkLost):
            self.cut()
        self._transport.close()


def lcus_command(channel: int, *, closed: bool) -> bytes:
    """Return the bytes that close or open a channel, counted from 1."""
    return bytes((LCUS_HEAD, channel, closed, (LCUS_HEAD + channel + closed) & 0xFF))
