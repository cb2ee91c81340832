"""Spoil what passes on a device's line: silence, stale frames, noise, latency."""

from collections import deque
from collections.abc import Callable
from typing import Protocol

import numpy as np

from drivers.clock import NS_PER_S
from sim_twin.device import TimedDevice, WireDevice


class Tampering(Protocol):
    """Change bytes on their way, at simulated time `now_ns`."""

    def heard(self, data: bytes, now_ns: int) -> bytes:
        """Return what reaches the device of what the host has sent."""
        ...

    def said(self, data: bytes, now_ns: int) -> bytes:
        """Return what reaches the host of what the device has sent."""
        ...


class LineTamper:
    """Be a device's line: pass everything on as it is, except through the tamperings in force.

    `frame_bytes` is the size of the frames that a talking sensor sends; None is for a bus, on which
    each answer counts as one frame. Whom the line `tells_time` learns it whenever it is talked to;
    others are stepped by somebody else.
    """

    def __init__(
        self,
        device: WireDevice,
        now_ns: Callable[[], int],
        frame_bytes: int | None = None,
        *,
        tells_time: bool = True,
    ) -> None:
        self.device = device
        self._timed = device if isinstance(device, TimedDevice) else None
        self._now_ns = now_ns
        self._tells_time = tells_time and self._timed is None
        self._frame_bytes = frame_bytes
        self._tamperings: list[Tampering] = []
        self._last_frames: dict[int, bytes] = {}

    def add(self, tampering: Tampering) -> None:
        """Put a tampering in force, behind those that are."""
        self._tamperings.append(tampering)

    def remove(self, tampering: Tampering) -> None:
        """Take a tampering out of force."""
        self._tamperings.remove(tampering)

    def receive(self, data: bytes) -> None:
        """Take bytes that the host has put on the line."""
        for tampering in self._tamperings:
            data = tampering.heard(data, self._now_ns())
        if data:
            self._tell_time()
            self.device.receive(data)

    def transmit(self) -> bytes:
        """Return and forget the bytes that are ready for the host."""
        self._tell_time()
        data = self.device.transmit()
        if not self._tamperings:
            if data:
                self._remember(data)
            return data
        for tampering in self._tamperings:
            data = tampering.said(data, self._now_ns())
        return data

    @property
    def paced(self) -> bool:
        """Return whether the device's bytes take time."""
        return self._timed is not None and self._timed.paced

    def next_due_ns(self) -> int | None:
        """Return when the device's next bytes arrive at the host; None when none are under way."""
        return None if self._timed is None else self._timed.next_due_ns()

    def step(self, now_ns: int) -> None:
        """Pass the time to a device whose bytes take time."""
        if self._timed is not None:
            self._timed.step(now_ns)

    def _tell_time(self) -> None:
        if self._tells_time:
            self.device.step(self._now_ns())

    def last_frame_like(self, data: bytes) -> bytes:
        """Return the newest whole frames from before any tampering, in place of `data`.

        A sensor repeats its very last frame as often as it sends new ones, time stamp, index and
        check sum included. A bus repeats its last answer of the same length.
        """
        size = self._frame_bytes
        if size is None:
            return self._last_frames.get(len(data), b"")
        return self._last_frames.get(size, b"") * (len(data) // size)

    def _remember(self, data: bytes) -> None:
        size = self._frame_bytes or len(data)
        self._last_frames[size] = data[-size:]


class Silence:
    """Lose everything, both ways."""

    def heard(self, data: bytes, now_ns: int) -> bytes:
        """Lose what the host says."""
        return b""

    def said(self, data: bytes, now_ns: int) -> bytes:
        """Lose what the device says."""
        return b""


class Stuck:
    """Repeat the last frame for ever; the host is still heard."""

    def __init__(self, line: LineTamper) -> None:
        self._line = line

    def heard(self, data: bytes, now_ns: int) -> bytes:
        """Pass on."""
        return data

    def said(self, data: bytes, now_ns: int) -> bytes:
        """Replace each new frame by the last one from before."""
        return self._line.last_frame_like(data)


class Garbage:
    """Replace every byte for the host by a random one."""

    def __init__(self, seed: int) -> None:
        self._random = np.random.default_rng(seed)

    def heard(self, data: bytes, now_ns: int) -> bytes:
        """Pass on."""
        return data

    def said(self, data: bytes, now_ns: int) -> bytes:
        """Return noise of the same length."""
        return self._random.bytes(len(data))


class Latency:
    """Hold back what the device says for a while."""

    def __init__(self, delay_s: float) -> None:
        self._delay_ns = round(delay_s * NS_PER_S)
        self._held: deque[tuple[int, bytes]] = deque()

    def heard(self, data: bytes, now_ns: int) -> bytes:
        """Pass on."""
        return data

    def said(self, data: bytes, now_ns: int) -> bytes:
        """Return what has waited long enough."""
        if data:
            self._held.append((now_ns + self._delay_ns, data))
        ready = []
        while self._held and self._held[0][0] <= now_ns:
            ready.append(self._held.popleft()[1])
        return b"".join(ready)
