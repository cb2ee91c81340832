import struct
import time
import zlib

import numpy as np
import pytest

from drivers.camera.rgbd_stream import RgbdCamera
from sim_twin.contracts.scripted import ManualClock, ScriptedLine

MS = 1_000_000


def frame(
    sequence: int,
    exposure_ns: int = 0,
    width: int = 4,
    height: int = 3,
    fill: int = 7,
    sent_after_ms: float = 0.0,
) -> bytes:
    """Encode independently of the driver, straight from the protocol's table."""
    pixels = width * height
    payload = bytes([fill]) * (3 * pixels) + struct.pack("<H", 1000 + fill) * pixels
    head = (
        b"VRGB"
        + bytes([1, 0])
        + struct.pack("<HIQHH", round(10 * sent_after_ms), sequence, exposure_ns, width, height)
    )
    head += struct.pack("<5fI", 200.0, 201.0, 1.5, 1.0, 0.001, len(payload))
    return (
        head
        + struct.pack("<I", zlib.crc32(head))
        + payload
        + struct.pack("<I", zlib.crc32(payload))
    )


def make(now_ns: int = 10**9) -> tuple[RgbdCamera, ScriptedLine, ManualClock]:
    line, clock = ScriptedLine(), ManualClock(now_ns)
    return RgbdCamera(line, clock), line, clock


def test_a_frame_is_read_field_by_field() -> None:
    camera, line, _ = make()
    line.pending += frame(5, exposure_ns=123)
    got = camera.poll()
    assert got is not None
    assert got.sequence == 5
    assert (got.intrinsics.width, got.intrinsics.height) == (4, 3)
    assert (got.intrinsics.fx, got.intrinsics.fy) == (200.0, 201.0)
    assert (got.intrinsics.cx, got.intrinsics.cy) == (1.5, 1.0)
    assert got.rgb.shape == (3, 4, 3)
    assert np.all(got.rgb == 7)
    assert np.all(got.depth == 1007)
    assert got.depth_m() == pytest.approx(np.full((3, 4), 1.007))
    assert camera.poll() is None


def test_start_and_stop_are_the_documented_bytes() -> None:
    camera, line, _ = make()
    camera.start(12.5)
    camera.stop()
    start = b"VRGC\x01\x01" + struct.pack("<H", 125)
    stop = b"VRGC\x01\x00" + struct.pack("<H", 0)
    assert bytes(line.sent) == b"".join(
        part + struct.pack("<I", zlib.crc32(part)) for part in (start, stop)
    )


@pytest.mark.parametrize("rate_hz", [0.0, -1.0, 1001.0])
def test_an_impossible_rate_is_refused(rate_hz: float) -> None:
    camera, _, _ = make()
    with pytest.raises(ValueError, match="rate"):
        camera.start(rate_hz)


def test_the_newest_frame_wins_and_the_others_are_counted() -> None:
    camera, line, _ = make()
    line.pending += frame(1) + frame(2) + frame(5)
    got = camera.poll()
    assert got is not None
    assert got.sequence == 5
    assert camera.counters.superseded_frames == 2
    assert camera.counters.lost_frames == 2


def test_a_truncated_frame_costs_only_itself() -> None:
    camera, line, _ = make()
    line.pending += frame(1)[:70] + frame(2) + frame(3)
    got = camera.poll()
    assert got is not None
    assert got.sequence == 3
    assert camera.counters.frames == 2
    assert camera.counters.crc_errors == 1


def test_a_silent_camera_is_asked_again() -> None:
    camera, line, clock = make()
    camera.start(10.0)
    line.sent.clear()
    clock.ns += 1_900 * MS
    camera.poll()
    assert not line.sent
    clock.ns += 300 * MS
    camera.poll()
    assert line.sent.startswith(b"VRGC\x01\x01")
    assert camera.counters.restarts == 1


def test_a_stopped_camera_is_left_alone() -> None:
    camera, line, clock = make()
    camera.start(10.0)
    camera.stop()
    line.sent.clear()
    clock.ns += 10_000 * MS
    camera.poll()
    assert not line.sent


def test_a_camera_that_restarts_its_clock_is_followed() -> None:
    camera, line, clock = make()
    line.pending += frame(1, exposure_ns=50_000_000_000)
    camera.poll()
    clock.ns = 5_000_000_000
    line.pending += frame(0, exposure_ns=1_000_000)
    got = camera.poll()
    assert got is not None
    assert got.stamp_ns == clock.ns


def test_how_long_the_camera_itself_took_is_no_part_of_the_way_to_the_host() -> None:
    camera, line, clock = make()
    clock.ns = 5_000 * MS
    line.pending += frame(1, exposure_ns=1_000 * MS, sent_after_ms=40.0)
    got = camera.poll()
    assert got is not None
    assert got.stamp_ns == 4_960 * MS


def test_large_frames_in_small_pieces_do_not_take_quadratic_time() -> None:
    camera, line, _ = make()
    data = frame(1, width=640, height=480)
    started = time.process_time()
    for at in range(0, len(data), 4096):
        line.pending += data[at : at + 4096]
        camera.poll()
    assert camera.counters.frames == 1
    # 375 polls; copying the buffer each time would move 290 MB.
    assert time.process_time() - started < 0.25
