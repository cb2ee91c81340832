"""Emulate the relay in the servos' supply: one that pulses hold, and one that is told."""

from typing import Protocol

from drivers.clock import NS_PER_S
from drivers.power_relay.lcus_relay import LCUS_BYTES, LCUS_HEAD
from drivers.power_relay.open_relay import PULSED
from sim_twin.device import WireDevice
from vla_deploy.robots.devices import PowerRelayDescription


class EmulatedRelay(WireDevice, Protocol):
    """Stand in the supply of the servos."""

    def is_closed(self, now_ns: int) -> bool:
        """Return whether the servos have their supply."""
        ...


class PulsedRelayDevice:
    """Hold the relay for a while after each rising edge of a line, whose levels come as 0 and 1."""

    def __init__(self, hold_s: float) -> None:
        self._hold_ns = round(hold_s * NS_PER_S)
        self._is_high = False
        self._now_ns = 0
        self._until_ns = 0

    def is_closed(self, now_ns: int) -> bool:
        """Return whether the last edge was not long ago."""
        return now_ns < self._until_ns

    def receive(self, data: bytes) -> None:
        """Take levels of the line."""
        for level in data.decode("ascii", "replace"):
            if level == "1" and not self._is_high:
                self._until_ns = self._now_ns + self._hold_ns
            self._is_high = level == "1"

    def transmit(self) -> bytes:
        """Return nothing: an output tells nothing."""
        return b""

    def announce(self) -> None:
        """Keep the level: a line stays as the last host left it."""

    def step(self, now_ns: int) -> None:
        """Take over the time."""
        self._now_ns = now_ns


class LcusRelayDevice:
    """Stay as the last whole command said, whatever becomes of the host."""

    def __init__(self, channel: int) -> None:
        self._channel = channel
        self._is_closed = False
        self._pending = bytearray()

    def is_closed(self, now_ns: int) -> bool:
        """Return what the channel was told."""
        del now_ns
        return self._is_closed

    def receive(self, data: bytes) -> None:
        """Take commands; what is none is passed over byte by byte."""
        self._pending += data
        while len(self._pending) >= LCUS_BYTES:
            head, channel, state, total = self._pending[:LCUS_BYTES]
            if head != LCUS_HEAD or (head + channel + state) & 0xFF != total or state > 1:
                del self._pending[0]
                continue
            del self._pending[:LCUS_BYTES]
            if channel == self._channel:
                self._is_closed = state == 1

    def transmit(self) -> bytes:
        """Return nothing: the board answers nothing."""
        return b""

    def step(self, now_ns: int) -> None:
        """Ignore the time: there is no timer on it."""


def emulated_relay(relay: PowerRelayDescription) -> PulsedRelayDevice | LcusRelayDevice:
    """Return the relay of a robot file."""
    if relay.model == PULSED:
        return PulsedRelayDevice(relay.hold_s or 0.0)
    return LcusRelayDevice(relay.number)
