"""Serve an emulated device on a pseudo-terminal behind a stable path, for a driver in any process.

The line holds its own end of the terminal open, so that a poll on it wakes for bytes alone and not
because no driver is there yet. Bytes that nobody fetches are lost once the terminal is full, as on
a UART without a listener; `lost_bytes` counts them.

A pseudo-terminal has no speed of its own, but keeps the one that the host has set: `on_baud` is
told it before the bytes that came at it.
"""

import fcntl
import os
import struct
import tty
from collections.abc import Callable
from pathlib import Path
from typing import Final

from drivers.errors import LinkLost
from sim_twin.device import WireDevice

_CHUNK_BYTES: Final = 4096
_TCGETS2: Final = 0x802C542A
_TERMIOS2: Final = struct.Struct("4I20s2I")
"""Four words of flags, line discipline and characters, speed in, speed out: any speed, not only
those with a constant, as <asm-generic/termbits.h> has it."""


class PtyLine:
    """Carry bytes between a pseudo-terminal and a device; belongs to one single-threaded loop.

    With `now_ns` the device learns its time whenever bytes may pass, not only when it is stepped;
    `on_bytes` gets what passes, in both directions.
    """

    def __init__(
        self,
        device: WireDevice,
        link_path: Path,
        *,
        now_ns: Callable[[], int] | None = None,
        on_baud: Callable[[int], None] | None = None,
        on_bytes: Callable[[bytes], None] = lambda _: None,
    ) -> None:
        self.link_path = link_path
        self.lost_bytes = 0
        self._device = device
        self._now_ns = now_ns
        self._on_baud = on_baud
        self._on_bytes = on_bytes
        self._ends: tuple[int, int] | None = None
        self.replug()

    @property
    def is_plugged(self) -> bool:
        """Return whether there is a terminal."""
        return self._ends is not None

    def fileno(self) -> int:
        """Return the descriptor to poll for input.

        Raises:
            LinkLost: the line is unplugged.
        """
        return self._plugged_ends()[0]

    def poll_once(self) -> bool:
        """Hand over what the host has sent and send what the device has ready; False when idle.

        Raises:
            LinkLost: the line is unplugged.
        """
        line, terminal = self._plugged_ends()
        request = self._read(line)
        if self._now_ns is not None:
            self._device.step(self._now_ns())
        if request:
            if self._on_baud is not None:
                self._on_baud(_baud_of(terminal))
            self._on_bytes(request)
            self._device.receive(request)
        return self._send(line) or bool(request)

    def send_once(self) -> bool:
        """Send what the device has ready by now, and leave what the host has sent; False when idle.

        Raises:
            LinkLost: the line is unplugged.
        """
        line, _ = self._plugged_ends()
        if self._now_ns is not None:
            self._device.step(self._now_ns())
        return self._send(line)

    def send_at(self, due_ns: int, now_ns: Callable[[], int]) -> None:
        """Take what the device has ready at `due_ns`, watch the clock, and send it at that moment.

        Raises:
            LinkLost: the line is unplugged.
        """
        line, _ = self._plugged_ends()
        self._device.step(due_ns)
        reply = self._device.transmit()
        while now_ns() < due_ns:
            pass
        if reply:
            self._write(line, reply)

    def unplug(self) -> None:
        """Take the terminal away, as pulling the cable does: the host's reads and writes fail."""
        if self._ends is None:
            return
        self.link_path.unlink(missing_ok=True)
        for end in self._ends:
            os.close(end)
        self._ends = None

    def replug(self) -> None:
        """Put a new terminal behind the same path; nothing happens while one is there."""
        if self._ends is not None:
            return
        line, terminal = os.openpty()
        self._ends = (line, terminal)
        tty.setraw(terminal)
        os.set_blocking(line, False)
        self._device.transmit()  # what was under way when the cable was pulled
        self._link_to(os.ttyname(terminal))

    def close(self) -> None:
        """Unplug for good; closing twice is allowed."""
        self.unplug()

    def _link_to(self, terminal_path: str) -> None:
        """Replace the link in one act, so that a driver never finds none."""
        self.link_path.parent.mkdir(parents=True, exist_ok=True)
        fresh = self.link_path.with_name(f".{self.link_path.name}.{os.getpid()}")
        fresh.unlink(missing_ok=True)
        fresh.symlink_to(terminal_path)
        fresh.replace(self.link_path)

    def _plugged_ends(self) -> tuple[int, int]:
        if self._ends is None:
            raise LinkLost(f"{self.link_path}: unplugged; call replug() before using the line")
        return self._ends

    def _send(self, line: int) -> bool:
        reply = self._device.transmit()
        if reply:
            self._write(line, reply)
        return bool(reply)

    def _read(self, line: int) -> bytes:
        try:
            return os.read(line, _CHUNK_BYTES)
        except BlockingIOError:
            return b""

    def _write(self, line: int, reply: bytes) -> None:
        self._on_bytes(reply)
        try:
            sent = os.write(line, reply)
        except BlockingIOError:
            sent = 0
        self.lost_bytes += len(reply) - sent


def _baud_of(terminal: int) -> int:
    """Return the speed at which the host sends."""
    settings = fcntl.ioctl(terminal, _TCGETS2, bytes(_TERMIOS2.size))
    speed: int = _TERMIOS2.unpack(settings)[-1]
    return speed
