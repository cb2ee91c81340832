"""Emulate the RGB-D camera's server: renders when streaming was asked for and a frame is due."""

import zlib
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from drivers.camera.protocol import (
    CRC,
    REQUEST_BYTES,
    REQUEST_MAGIC,
    CameraCommand,
    FrameHeader,
    Intrinsics,
    decode_request,
    encode_header,
)
from drivers.clock import NS_PER_S

DEPTH_UNIT_M = 0.001
DEPTH_SIGMA_PER_M = 0.0012
MIN_DEPTH_M = 0.1
MAX_DEPTH_M = 10.0

Render = Callable[[], tuple[NDArray[np.uint8], NDArray[np.float32]]]


class CameraDevice:
    """Serve frames of `render` (RGB uint8 and depth in metres along the optical axis).

    Depth noise has sigma = `depth_sigma_per_m` * z^2, as stereo cameras have; 0 switches it off.
    `latency_s` is the time from exposure to the first byte on the line. `depth_ratio` (told over
    true depth) and `rate_ratio` (given over asked-for rate) may be changed at any time. The depth
    of a camera that has none is 0 everywhere.
    """

    def __init__(
        self,
        render: Render,
        intrinsics: Intrinsics,
        *,
        depth_sigma_per_m: float = DEPTH_SIGMA_PER_M,
        latency_s: float = 0.0,
        seed: int = 0,
        has_depth: bool = True,
    ) -> None:
        self.depth_ratio = 1.0
        self.rate_ratio = 1.0
        self._render = render
        self._intrinsics = intrinsics
        self._sigma_per_m = depth_sigma_per_m
        self._has_depth = has_depth
        self._latency_ns = round(latency_s * NS_PER_S)
        self._random = np.random.default_rng(seed)
        self._requests = bytearray()
        self._out = bytearray()
        self._in_flight: list[tuple[int, bytes]] = []
        self._period_ns = 0
        self._due_ns: int | None = None
        self._sequence = 0

    def receive(self, data: bytes) -> None:
        """Take START and STOP requests; skip anything else."""
        self._requests += data
        while (at := self._requests.find(REQUEST_MAGIC)) >= 0:
            del self._requests[:at]
            if len(self._requests) < REQUEST_BYTES:
                return
            request = decode_request(bytes(self._requests[:REQUEST_BYTES]))
            if request is None:
                del self._requests[: len(REQUEST_MAGIC)]
                continue
            del self._requests[:REQUEST_BYTES]
            self._apply(*request)
        del self._requests[: max(0, len(self._requests) - len(REQUEST_MAGIC) + 1)]

    def transmit(self) -> bytes:
        """Return and forget the frames that are ready."""
        data = bytes(self._out)
        self._out.clear()
        return data

    def is_due(self, now_ns: int) -> bool:
        """Return whether the next step exposes a frame."""
        return self._period_ns > 0 and (self._due_ns is None or now_ns >= self._due_ns)

    def next_event_ns(self, otherwise_ns: int) -> int:
        """Return when the next frame is exposed or handed over, `otherwise_ns` where none is."""
        ready = [ready_ns for ready_ns, _ in self._in_flight[:1]]
        due = [self._due_ns] if self._period_ns and self._due_ns is not None else []
        return min([*ready, *due], default=otherwise_ns)

    def step(self, now_ns: int) -> None:
        """Expose a frame when one is due; hand over those whose latency has passed."""
        if self.is_due(now_ns):
            period_ns = round(self._period_ns / self.rate_ratio)
            self._due_ns = max((self._due_ns or now_ns) + period_ns, now_ns)
            self._in_flight.append((now_ns + self._latency_ns, self._frame(now_ns)))
        while self._in_flight and self._in_flight[0][0] <= now_ns:
            self._out += self._in_flight.pop(0)[1]

    def _apply(self, command: CameraCommand, rate_hz: float) -> None:
        streaming = command is CameraCommand.START and rate_hz > 0.0
        period_ns = round(NS_PER_S / rate_hz) if streaming else 0
        if period_ns != self._period_ns:
            self._period_ns, self._due_ns = period_ns, None

    def _frame(self, now_ns: int) -> bytes:
        rgb, depth_m = self._render()
        header = FrameHeader(
            sequence=self._sequence,
            exposure_ns=now_ns,
            intrinsics=self._intrinsics,
            depth_unit_m=DEPTH_UNIT_M,
            sent_after_ns=self._latency_ns,
        )
        self._sequence += 1
        payload = np.ascontiguousarray(rgb).tobytes() + self._quantised(depth_m).tobytes()
        if len(payload) != header.payload_bytes:
            raise ValueError(
                f"camera: expected an image of {self._intrinsics.width}x{self._intrinsics.height},"
                f" got rgb {rgb.shape} and depth {depth_m.shape}; check the renderer's size"
            )
        return encode_header(header) + payload + CRC.pack(zlib.crc32(payload))

    def _quantised(self, depth_m: NDArray[np.float32]) -> NDArray[np.uint16]:
        if not self._has_depth:
            return np.zeros(depth_m.shape, dtype="<u2")
        seen = (depth_m >= MIN_DEPTH_M) & (depth_m <= MAX_DEPTH_M)
        noisy_m = depth_m
        if self._sigma_per_m:
            noise = self._random.standard_normal(depth_m.shape, dtype=np.float32)
            noisy_m = depth_m + np.float32(self._sigma_per_m) * depth_m**2 * noise
        units = np.rint(noisy_m * np.float32(self.depth_ratio / DEPTH_UNIT_M)).clip(1, 65_535)
        return np.where(seen, units, 0).astype("<u2")
