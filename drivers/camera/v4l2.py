"""Drive a colour camera: V4L2 by OpenCV, a GStreamer pipeline, or a video file.

Stamps: for a video device OpenCV tells the kernel's stamp of the buffer, which UVC and most other
drivers take from CLOCK_MONOTONIC at the start of the exposure or of the transfer. Where there is
none, or it cannot be true, the stamp is the time of arrival less the declared latency; each frame
says which, and `arrival_stamps` counts the latter.
"""

from collections.abc import Callable
from typing import Final

from drivers.camera.base import CameraCounters, ColourFrame, StampSource
from drivers.camera.capture import (
    Capture,
    CaptureRequest,
    Granted,
    check_granted,
    granted,
    open_capture,
)
from drivers.camera.grabber import Grabbed, Grabber
from drivers.clock import NS_PER_S, Clock
from drivers.errors import LinkLost

OPEN_PATIENCE_NS: Final = 10 * NS_PER_S
SILENCE_NS: Final = 2 * NS_PER_S
MAX_BUFFER_AGE_NS: Final = NS_PER_S


class VideoCamera:
    """Give the newest image of a source; `latency_s` is from exposure to arrival."""

    def __init__(
        self,
        request: CaptureRequest,
        clock: Clock,
        *,
        latency_s: float = 0.0,
        connect: Callable[[CaptureRequest], Capture] = open_capture,
    ) -> None:
        """Begin to open the source, which may take a second; `poll` tells what became of it."""
        self.counters = CameraCounters()
        self._request = request
        self._clock = clock
        self._latency_ns = round(latency_s * NS_PER_S)
        self._connect = connect
        self._next_number = 0
        self._heard_ns = clock.now_ns()
        self._last_stamp_ns = 0
        self._grabber = Grabber(self._open, clock, request.source)

    @property
    def granted(self) -> Granted | None:
        """Return what the source delivers, or None until it is open."""
        return self._grabber.granted

    def poll(self) -> ColourFrame | None:
        """Return the newest frame since the last call, or None; never waits.

        Raises:
            DeviceMissing: there is no such source, or this OpenCV cannot open its kind.
            DeviceBusy: another process has the camera.
            WrongDevice: the source delivers another size, rate or format than asked for.
            LinkLost: the camera has gone, or was silent for 2 s.
        """
        grabbed = self._grabber.newest()
        if grabbed is None:
            self._check_silence()
            return None
        self._heard_ns = grabbed.arrival_ns
        self._count(grabbed)
        stamp_ns, source = self._stamp(grabbed)
        # Arrivals jitter more than exposures: a stamp must still be later than the one before it.
        self._last_stamp_ns = max(stamp_ns, self._last_stamp_ns + 1)
        return ColourFrame(
            stamp_ns=self._last_stamp_ns,
            sequence=grabbed.number,
            stamp_source=source,
            rgb=grabbed.rgb,
        )

    def close(self) -> None:
        """Let go of the camera as soon as its read under way ends; closing twice is allowed."""
        self._grabber.stop()

    def _open(self) -> Capture:
        capture = self._connect(self._request)
        try:
            check_granted(self._request, granted(capture))
        except BaseException:
            capture.release()
            raise
        return capture

    def _check_silence(self) -> None:
        patience_ns = SILENCE_NS if self._next_number else OPEN_PATIENCE_NS
        if self._clock.now_ns() - self._heard_ns > patience_ns:
            raise LinkLost(
                f"{self._request.source}: no image for {patience_ns / NS_PER_S:g} s; "
                "plug the camera in again"
            )

    def _count(self, grabbed: Grabbed) -> None:
        self.counters.superseded_frames += grabbed.number - self._next_number
        self.counters.frames += grabbed.number - self._next_number + 1
        self._next_number = grabbed.number + 1

    def _stamp(self, grabbed: Grabbed) -> tuple[int, StampSource]:
        age_ns = grabbed.arrival_ns - grabbed.backend_ns
        if self._request.is_device and 0 <= age_ns <= MAX_BUFFER_AGE_NS:
            return grabbed.backend_ns, StampSource.BUFFER
        self.counters.arrival_stamps += 1
        return grabbed.arrival_ns - self._latency_ns, StampSource.ARRIVAL
