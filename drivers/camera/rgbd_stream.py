"""Drive an RGB-D camera that speaks the stream protocol of `drivers/camera/protocol.py`."""

import zlib

import numpy as np

from drivers.base import ByteTransport
from drivers.camera.base import CameraCounters, RgbdFrame
from drivers.camera.protocol import (
    CRC,
    FRAME_MAGIC,
    HEADER_BYTES,
    CameraCommand,
    FrameHeader,
    decode_header,
    encode_request,
)
from drivers.clock import NS_PER_S, Clock
from drivers.device_clock import DeviceClock

RESTART_NS = 2 * NS_PER_S
MAX_RATE_HZ = 1000.0
_READ_BYTES = 1 << 20
_POLL_BYTES = 1 << 23
_REST_NS = 10_000_000
"""A frame is larger than the buffers on its way: for so long the rest of one is read on."""


class RgbdCamera:
    """Receive the newest frame of a stream and keep the stream alive."""

    def __init__(self, transport: ByteTransport, clock: Clock) -> None:
        self.counters = CameraCounters()
        self._transport = transport
        self._clock = clock
        self._device_clock = DeviceClock()
        self._buffer = bytearray()
        self._last_sequence: int | None = None
        self._last_shot: tuple[int, int] | None = None
        self._rate_hz = 0.0
        self._heard_ns = 0

    def start(self, rate_hz: float) -> None:
        """Ask for frames at `rate_hz`.

        Raises:
            ValueError: the rate is not above 0 and at most 1000 Hz.
            LinkLost: the stream has gone.
        """
        if not 0.0 < rate_hz <= MAX_RATE_HZ:
            raise ValueError(
                f"camera: expected a rate above 0 and at most {MAX_RATE_HZ} Hz, got {rate_hz}"
            )
        self._rate_hz = rate_hz
        self._heard_ns = self._clock.now_ns()
        self._transport.write(encode_request(CameraCommand.START, rate_hz))

    def stop(self) -> None:
        """Ask the camera to stop streaming.

        Raises:
            LinkLost: the stream has gone.
        """
        self._rate_hz = 0.0
        self._transport.write(encode_request(CameraCommand.STOP, 0.0))

    def close(self) -> None:
        """Release the stream."""
        self._transport.close()

    def poll(self) -> RgbdFrame | None:
        """Return the newest frame completed since the last call, or None.

        It waits for nothing but the rest of a frame that is arriving, 10 ms at most. A camera that
        stays silent for 2 s is asked again to start: its server may be a new one.

        Raises:
            LinkLost: the stream has gone.
        """
        newest = self._newest() if self._fill(0) else None
        until_ns = self._clock.now_ns() + _REST_NS
        while newest is None and self._buffer and self._fill(until_ns):
            newest = self._newest()
        self._keep_alive(heard=newest is not None)
        return newest

    def _newest(self) -> RgbdFrame | None:
        newest = None
        while (found := self._next_frame()) is not None:
            self.counters.superseded_frames += newest is not None
            newest = found
        return newest

    def _fill(self, deadline_ns: int) -> bool:
        """Read what is there, bounded so that a fast sender cannot hold up the caller.

        Return False where nothing came by the deadline.
        """
        had_bytes = len(self._buffer)
        while len(self._buffer) < _POLL_BYTES:
            chunk = self._transport.read(_READ_BYTES, deadline_ns)
            if not chunk:
                break
            self._buffer += chunk
            deadline_ns = 0
        return len(self._buffer) > had_bytes

    def _keep_alive(self, *, heard: bool) -> None:
        now_ns = self._clock.now_ns()
        if heard:
            self._heard_ns = now_ns
        elif self._rate_hz and now_ns - self._heard_ns > RESTART_NS + NS_PER_S / self._rate_hz:
            self.counters.restarts += 1
            self.start(self._rate_hz)

    def _next_frame(self) -> RgbdFrame | None:
        """Cut the next intact frame from the buffer; skip what is not one."""
        while self._seek_magic() and len(self._buffer) >= HEADER_BYTES:
            header = decode_header(bytes(self._buffer[:HEADER_BYTES]))
            if header is None:
                self._reject()
                continue
            end = HEADER_BYTES + header.payload_bytes
            if len(self._buffer) < end + CRC.size:
                return None
            payload = bytes(memoryview(self._buffer)[HEADER_BYTES:end])
            if zlib.crc32(payload) != CRC.unpack_from(self._buffer, end)[0]:
                self._reject()
                continue
            del self._buffer[: end + CRC.size]
            if not self._is_repeated(header):
                return self._frame(header, payload)
        return None

    def _seek_magic(self) -> bool:
        """Drop bytes up to the next magic; false when there is none yet."""
        at = self._buffer.find(FRAME_MAGIC)
        # The tail may be the beginning of a magic of which the rest is still on its way.
        count = max(0, len(self._buffer) - len(FRAME_MAGIC) + 1) if at < 0 else at
        self._discard(count)
        return at >= 0

    def _reject(self) -> None:
        self.counters.crc_errors += 1
        self._discard(len(FRAME_MAGIC))

    def _discard(self, count: int) -> None:
        self.counters.discarded_bytes += count
        del self._buffer[:count]

    def _is_repeated(self, header: FrameHeader) -> bool:
        """Count a frame that was there before: a stuck camera's, which shows nothing of now."""
        shot = header.sequence, header.exposure_ns
        repeated, self._last_shot = shot == self._last_shot, shot
        self.counters.repeated_frames += repeated
        return repeated

    def _frame(self, header: FrameHeader, payload: bytes) -> RgbdFrame:
        self.counters.frames += 1
        if self._last_sequence is not None and header.sequence > self._last_sequence:
            self.counters.lost_frames += header.sequence - self._last_sequence - 1
        self._last_sequence = header.sequence
        camera = header.intrinsics
        pixels = camera.width * camera.height
        rgb = np.frombuffer(payload, dtype=np.uint8, count=3 * pixels)
        depth = np.frombuffer(payload, dtype="<u2", offset=3 * pixels)
        return RgbdFrame(
            stamp_ns=self._device_clock.to_host_ns(
                header.exposure_ns, self._clock.now_ns() - header.sent_after_ns
            ),
            sequence=header.sequence,
            intrinsics=camera,
            depth_unit_m=header.depth_unit_m,
            rgb=rgb.reshape(camera.height, camera.width, 3),
            depth=depth.reshape(camera.height, camera.width),
        )
