"""The colour camera on real video files, on a source that the test controls, and without one.

No video device is at hand where these tests run: V4L2's part of OpenCV is not exercised here.
"""

import queue
import re
import threading
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from drivers.camera.base import ColourFrame, StampSource
from drivers.camera.capture import CaptureRequest, open_capture
from drivers.camera.protocol import Intrinsics
from drivers.camera.v4l2 import VideoCamera
from drivers.clock import NS_PER_S, MonotonicClock
from drivers.errors import DeviceMissing, DriverError, LinkLost, WrongDevice
from drivers.registry import open_camera
from drivers.reopening import Reopening
from sim_twin.contracts.bench import HardwareBench
from sim_twin.contracts.camera import ColourCameraContract
from sim_twin.contracts.scripted import ManualClock

CLOCK = MonotonicClock()
WIDTH, HEIGHT, RATE_HZ, FRAMES = 64, 48, 25.0, 60


@pytest.fixture(scope="module")
def film(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("film") / "grey.avi"
    fourcc = cv2.VideoWriter.fourcc(*"MJPG")
    writer = cv2.VideoWriter(str(path), cv2.CAP_FFMPEG, fourcc, RATE_HZ, (WIDTH, HEIGHT))
    for number in range(FRAMES):
        image = np.full((HEIGHT, WIDTH, 3), (0, 2 * number, 200), np.uint8)
        writer.write(image)
    writer.release()
    return path


class Paced:
    """Slow a real capture down to a camera's rate."""

    def __init__(self, request: CaptureRequest) -> None:
        self._capture = open_capture(request)
        self._pause = threading.Event()

    def read(self) -> tuple[bool, Any]:
        self._pause.wait(0.01)
        return self._capture.read()

    def get(self, prop: int, /) -> float:
        return self._capture.get(prop)

    def release(self) -> None:
        self._capture.release()


class TestOnAFile(ColourCameraContract):
    patience_s = 0.3

    @pytest.fixture
    def bench(self, film: Path) -> HardwareBench[VideoCamera]:
        request = CaptureRequest(source=str(film))
        return HardwareBench(lambda clock: VideoCamera(request, clock, connect=Paced))


def until(give: Callable[[], Any]) -> Any:
    """Return the first value; the thread at work has the test's whole time limit."""
    while True:
        if (value := give()) is not None:
            return value
        CLOCK.sleep_until(CLOCK.now_ns() + 1_000_000)


def failure_of(camera: VideoCamera) -> DriverError:
    def raised() -> DriverError | None:
        try:
            camera.poll()
        except DriverError as error:
            return error
        return None

    error: DriverError = until(raised)
    return error


def test_a_file_gives_its_images_in_red_green_blue_and_reports_its_end(film: Path) -> None:
    camera = VideoCamera(CaptureRequest(source=str(film)), CLOCK)
    frames: list[ColourFrame] = []

    def poll_to_the_end() -> DriverError | None:
        try:
            if (frame := camera.poll()) is not None:
                frames.append(frame)
        except DriverError as error:
            return error
        return None

    error = until(poll_to_the_end)
    assert isinstance(error, LinkLost)
    assert "no more images" in str(error)
    last = frames[-1]
    assert last.sequence == FRAMES - 1
    assert camera.counters.frames == FRAMES
    assert camera.counters.superseded_frames == FRAMES - len(frames)
    assert last.rgb.shape == (HEIGHT, WIDTH, 3)
    red, green, blue = last.rgb[20, 30].tolist()
    assert red == pytest.approx(200, abs=8)
    assert green == pytest.approx(2 * (FRAMES - 1), abs=8)
    assert blue < 10
    camera.close()


def test_the_registry_opens_a_device_as_a_camera_without_depth(film: Path) -> None:
    lens = Intrinsics(width=WIDTH, height=HEIGHT, fx=60.0, fy=60.0, cx=31.5, cy=23.5)
    camera = open_camera("V4L2", str(film), CLOCK, rate_hz=5.0, pinhole=lens)
    frame = until(camera.poll)
    assert frame.rgb.shape == (HEIGHT, WIDTH, 3)
    assert frame.depth.shape == (HEIGHT, WIDTH)
    assert not frame.depth_m().any()
    assert (frame.intrinsics, frame.stamp_source) == (lens, StampSource.ARRIVAL)
    assert camera.counters.frames > 0
    camera.close()
    with pytest.raises(ValueError, match="expected a lens"):
        open_camera("V4L2", str(film), CLOCK, rate_hz=5.0)


def test_the_granted_format_is_reported(film: Path) -> None:
    request = CaptureRequest(
        source=str(film), width=WIDTH, height=HEIGHT, rate_hz=RATE_HZ, fourcc="MJPG"
    )
    camera = VideoCamera(request, CLOCK, connect=Paced)
    assert until(camera.poll) is not None
    assert str(camera.granted) == "64x48 at 25 Hz, format MJPG"
    camera.close()


@pytest.mark.parametrize(
    ("asked", "reported"),
    [
        ({"width": 640, "height": 480}, "width 640 asked, 64 got; height 480 asked, 48 got"),
        ({"rate_hz": 30.0}, "rate in Hz 30.0 asked, 25.0 got"),
        ({"fourcc": "YUYV"}, "format YUYV asked, MJPG got"),
    ],
)
def test_another_size_rate_or_format_than_asked_is_the_wrong_device(
    film: Path, asked: dict[str, Any], reported: str
) -> None:
    error = failure_of(VideoCamera(CaptureRequest(source=str(film), **asked), CLOCK))
    assert isinstance(error, WrongDevice)
    assert reported in str(error)
    assert "v4l2-ctl" in str(error)


@pytest.mark.parametrize(
    ("source", "reason"),
    [
        ("{folder}/video0", "/dev/v4l/by-id"),
        ("{folder}/note.avi", "correct the source"),
        pytest.param(
            "nvarguscamerasrc ! nvvidconv ! video/x-raw,format=BGRx ! appsink",
            "built without GStreamer.*python3-opencv",
            marks=pytest.mark.skipif(
                cv2.videoio_registry.hasBackend(cv2.CAP_GSTREAMER),
                reason="this OpenCV has GStreamer",
            ),
        ),
    ],
    ids=["no such device", "no video", "no GStreamer"],
)
def test_a_source_that_cannot_be_opened_is_refused_with_what_to_do(
    tmp_path: Path, source: str, reason: str
) -> None:
    (tmp_path / "note.avi").write_text("nothing to see")
    source = source.replace("{folder}", str(tmp_path))
    error = failure_of(VideoCamera(CaptureRequest(source=source), CLOCK))
    assert isinstance(error, DeviceMissing)
    assert re.search(reason, str(error), re.DOTALL)


@pytest.mark.parametrize(
    "asked", [{"width": -1}, {"rate_hz": -5.0}, {"fourcc": "MJPEG"}, {"fourcc": "YU"}]
)
def test_an_impossible_request_is_refused(asked: dict[str, Any]) -> None:
    with pytest.raises(ValueError, match="video0"):
        CaptureRequest(source="/dev/video0", **asked)


@dataclass
class Led:
    """A source whose images, stamps and end the test controls."""

    images: "queue.Queue[tuple[bool, int]]" = field(default_factory=queue.Queue)
    stamp_ms: float = 0.0
    released: threading.Event = field(default_factory=threading.Event)
    asked: threading.Semaphore = field(default_factory=lambda: threading.Semaphore(0))

    def connect(self, request: CaptureRequest) -> "Led":
        return self

    def read(self) -> tuple[bool, Any]:
        self.asked.release()
        there, value = self.images.get()
        return there, np.full((4, 6, 3), value, np.uint8)

    def get(self, prop: int, /) -> float:
        return self.stamp_ms if prop == cv2.CAP_PROP_POS_MSEC else 0.0

    def release(self) -> None:
        self.released.set()

    def show(self, *values: int) -> None:
        """Deliver images, and wait until the driver is back for the next one."""
        for value in values:
            self.images.put((True, value))
        for _ in values:
            self.asked.acquire()


@pytest.fixture
def led() -> Iterator[Led]:
    led = Led()
    yield led
    led.images.put((False, 0))


@pytest.fixture
def device(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(CaptureRequest, "is_device", property(lambda _: True))


@pytest.fixture
def clock() -> ManualClock:
    return ManualClock(5 * NS_PER_S)


@pytest.fixture
def camera(led: Led, clock: ManualClock) -> Iterator[VideoCamera]:
    request = CaptureRequest(source="/dev/video0")
    camera = VideoCamera(request, clock, latency_s=0.05, connect=led.connect)
    led.asked.acquire()
    yield camera
    camera.close()


def shown(camera: VideoCamera) -> ColourFrame:
    frame = camera.poll()
    assert frame is not None
    return frame


def test_the_newest_image_wins_and_the_others_are_counted(led: Led, camera: VideoCamera) -> None:
    assert camera.poll() is None
    led.show(1, 2, 3)
    frame = shown(camera)
    assert (frame.sequence, frame.rgb[0, 0, 0]) == (2, 3)
    assert (camera.counters.frames, camera.counters.superseded_frames) == (3, 2)
    assert camera.poll() is None


def test_the_kernels_stamp_is_taken_where_it_can_be_true(
    led: Led, camera: VideoCamera, device: None
) -> None:
    led.stamp_ms = 4_970.0
    led.show(1)
    frame = shown(camera)
    assert (frame.stamp_ns, frame.stamp_source) == (4_970_000_000, StampSource.BUFFER)
    assert camera.counters.arrival_stamps == 0


@pytest.mark.parametrize("stamp_ms", [0.0, 3_999.0, 5_001.0, 1.7e12])
def test_an_impossible_stamp_gives_way_to_arrival_less_latency(
    led: Led, camera: VideoCamera, device: None, stamp_ms: float
) -> None:
    led.stamp_ms = stamp_ms
    led.show(1)
    frame = shown(camera)
    assert (frame.stamp_ns, frame.stamp_source) == (4_950_000_000, StampSource.ARRIVAL)
    assert camera.counters.arrival_stamps == 1


def test_a_file_has_no_stamps_of_exposure(led: Led, camera: VideoCamera) -> None:
    led.stamp_ms = 4_970.0
    led.show(1)
    frame = shown(camera)
    assert frame.stamp_source is StampSource.ARRIVAL


def test_two_seconds_of_silence_are_a_lost_link(
    led: Led, camera: VideoCamera, clock: ManualClock
) -> None:
    led.show(1)
    camera.poll()
    clock.ns += 2 * NS_PER_S
    assert camera.poll() is None
    clock.ns += 1
    with pytest.raises(LinkLost, match="no image for 2 s"):
        camera.poll()


def test_an_unplugged_camera_is_lost_and_lets_go_of_its_source(
    led: Led, camera: VideoCamera
) -> None:
    led.images.put((False, 0))
    error = failure_of(camera)
    assert isinstance(error, LinkLost)
    assert "plug the camera in again" in str(error)
    assert led.released.is_set()
    camera.close()
    camera.close()


def test_closing_waits_for_nothing_and_the_source_is_let_go_after_the_read(
    led: Led, camera: VideoCamera
) -> None:
    camera.close()
    assert not led.released.is_set()
    led.images.put((True, 1))
    assert led.released.wait(30.0)


def test_a_replugged_camera_comes_back_by_itself() -> None:
    sources = [Led(), Led()]
    waiting = iter(sources)
    clock = ManualClock(NS_PER_S)
    request = CaptureRequest(source="/dev/video0")
    slot = Reopening(
        "camera",
        lambda: VideoCamera(request, clock, connect=lambda _: next(waiting)),
        clock,
    )
    slot.open()
    sources[0].images.put((False, 0))

    def poll_until_lost() -> str | None:
        assert slot.poll(VideoCamera.poll, None) is None
        return slot.failure or None

    until(poll_until_lost)
    assert "no more images" in slot.failure
    clock.ns += NS_PER_S // 4
    slot.poll(VideoCamera.poll, None)
    sources[1].asked.acquire()
    sources[1].show(7)
    frame = slot.poll(VideoCamera.poll, None)
    assert frame is not None
    assert slot.reconnects == 1
    slot.close()
    sources[1].images.put((False, 0))
