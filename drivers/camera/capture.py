"""Open a colour camera by OpenCV and hold it to what was asked for.

A source is a video device (`/dev/video0`, better `/dev/v4l/by-id/...`, which survives another
order of plugging), a GStreamer pipeline that ends in `appsink` (recognised by its "!"), or a video
file.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, Protocol

import cv2
import numpy as np
from numpy.typing import NDArray

from drivers.errors import DeviceBusy, DeviceMissing, WrongDevice

RATE_TOLERANCE: Final = 0.05
_FOURCC_LENGTH: Final = 4


@dataclass(frozen=True, slots=True, kw_only=True)
class CaptureRequest:
    """Say which source to open and how; 0 or "" leaves a value to the camera.

    `fourcc` names the format on the wire, such as "MJPG" or "YUYV".
    """

    source: str
    width: int = 0
    height: int = 0
    rate_hz: float = 0.0
    fourcc: str = ""

    def __post_init__(self) -> None:
        """Check the values.

        Raises:
            ValueError: a size or rate is negative, or the format has no four letters.
        """
        if min(self.width, self.height, self.rate_hz) < 0:
            raise ValueError(f"{self.source}: sizes and rates start at 0, got {self}")
        if self.fourcc and len(self.fourcc) != _FOURCC_LENGTH:
            raise ValueError(f"{self.source}: a format has 4 letters, got {self.fourcc!r}")

    @property
    def is_pipeline(self) -> bool:
        """Return whether the source is a GStreamer pipeline."""
        return "!" in self.source

    @property
    def is_device(self) -> bool:
        """Return whether the source is a video device of the kernel."""
        return not self.is_pipeline and Path(self.source).is_char_device()


@dataclass(frozen=True, slots=True, kw_only=True)
class Granted:
    """Say what the camera really delivers."""

    width: int
    height: int
    rate_hz: float
    fourcc: str

    def __str__(self) -> str:
        return f"{self.width}x{self.height} at {self.rate_hz:g} Hz, format {self.fourcc or '?'}"


class Capture(Protocol):
    """Be an open source of images, as `cv2.VideoCapture` is one."""

    def read(self) -> tuple[bool, Any]:
        """Wait for the next image; False when there is none any more."""
        ...

    def get(self, prop: int, /) -> float:
        """Return a property."""
        ...

    def release(self) -> None:
        """Let go of the source."""
        ...


def open_capture(request: CaptureRequest) -> Capture:
    """Return the opened source; takes up to a second on some cameras.

    Raises:
        DeviceMissing: there is no such source, or this OpenCV cannot open its kind.
        DeviceBusy: another process has the camera.
    """
    backend = _backend(request)
    capture = cv2.VideoCapture(request.source, backend)
    if not capture.isOpened():
        capture.release()
        raise _not_opened(request)
    for prop, value in _asked(request):
        capture.set(prop, value)
    opened: Capture = capture
    return opened


def granted(capture: Capture) -> Granted:
    """Return what an opened source delivers."""
    code = int(capture.get(cv2.CAP_PROP_FOURCC)) & 0xFFFF_FFFF
    letters = code.to_bytes(_FOURCC_LENGTH, "little").decode("latin-1")
    return Granted(
        width=round(capture.get(cv2.CAP_PROP_FRAME_WIDTH)),
        height=round(capture.get(cv2.CAP_PROP_FRAME_HEIGHT)),
        rate_hz=capture.get(cv2.CAP_PROP_FPS),
        fourcc=letters if letters.isprintable() else "",
    )


def check_granted(request: CaptureRequest, got: Granted) -> None:
    """Hold the camera to what was asked for; OpenCV takes another size without a word.

    Raises:
        WrongDevice: it delivers something else; the message has both.
    """
    off = [
        f"{name} {asked} asked, {value} got"
        for name, asked, value, tolerance in (
            ("width", request.width, got.width, 0.0),
            ("height", request.height, got.height, 0.0),
            ("rate in Hz", request.rate_hz, got.rate_hz, RATE_TOLERANCE),
        )
        if asked and abs(value - asked) > tolerance * asked
    ]
    if request.fourcc and got.fourcc and request.fourcc != got.fourcc:
        off.append(f"format {request.fourcc} asked, {got.fourcc} got")
    if off:
        raise WrongDevice(
            f"{request.source}: {'; '.join(off)}; see `v4l2-ctl --list-formats-ext` "
            "for what the camera can do, and ask for that"
        )


def to_rgb(image: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return OpenCV's image with red first."""
    kind = cv2.COLOR_GRAY2RGB if image.ndim == 2 else cv2.COLOR_BGR2RGB
    rgb: NDArray[np.uint8] = cv2.cvtColor(image, kind)
    return rgb


def _backend(request: CaptureRequest) -> int:
    if request.is_pipeline:
        if not cv2.videoio_registry.hasBackend(cv2.CAP_GSTREAMER):
            raise DeviceMissing(
                f"{request.source!r} is a GStreamer pipeline and this OpenCV {cv2.__version__} was "
                "built without GStreamer; use the OpenCV of the Jetson's system (python3-opencv), "
                "or give a path such as /dev/video0"
            )
        return int(cv2.CAP_GSTREAMER)
    if not Path(request.source).exists():
        raise DeviceMissing(
            f"{request.source}: no such camera; plug it in, or correct the path "
            "(see `ls /dev/v4l/by-id`)"
        )
    return int(cv2.CAP_V4L2 if request.is_device else cv2.CAP_FFMPEG)


def _asked(request: CaptureRequest) -> list[tuple[int, float]]:
    """Return the properties in the order that V4L2 needs: the format decides about sizes."""
    fourcc = cv2.VideoWriter.fourcc(*request.fourcc) if request.fourcc else 0
    wanted = [
        (cv2.CAP_PROP_FOURCC, float(fourcc)),
        (cv2.CAP_PROP_FRAME_WIDTH, float(request.width)),
        (cv2.CAP_PROP_FRAME_HEIGHT, float(request.height)),
        (cv2.CAP_PROP_FPS, request.rate_hz),
    ]
    return [(prop, value) for prop, value in wanted if value and request.is_device]


def _not_opened(request: CaptureRequest) -> DeviceMissing | DeviceBusy:
    if request.is_device:
        return DeviceBusy(
            f"{request.source}: could not be opened; stop the process that holds it (see "
            "`fuser -v`), check that it captures (`v4l2-ctl --all`) and that you are in the group "
            "video"
        )
    what = "pipeline" if request.is_pipeline else "video"
    return DeviceMissing(f"{request.source}: could not be opened as a {what}; correct the source")
