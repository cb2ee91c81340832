import struct

import pytest

from drivers.imu.bno085_rvc import FRAME_BYTES, Bno085Rvc
from sim_twin.contracts.scripted import ManualClock, ScriptedLine

# BNO08X Data Sheet, section 1.3.5.2: the example frame and its meaning.
GOLDEN = bytes.fromhex("aaaade010092ff25088dfeecffd103000000e7")


def frame(index: int, yaw_cdeg: int = 0) -> bytes:
    body = struct.pack("<B6h3B", index % 256, yaw_cdeg, 0, 0, 0, 0, 1000, 0, 0, 0)
    return b"\xaa\xaa" + body + bytes([sum(body) % 256])


def make(now_ns: int = 10**9) -> tuple[Bno085Rvc, ScriptedLine]:
    line = ScriptedLine()
    return Bno085Rvc(line, ManualClock(now_ns)), line


def test_the_data_sheets_example_is_read_as_the_data_sheet_says() -> None:
    imu, line = make()
    line.pending += GOLDEN
    (sample,) = imu.poll()
    assert sample.index == 0xDE
    assert sample.yaw_rad == pytest.approx(0.000174533, abs=1e-8)
    assert sample.pitch_rad == pytest.approx(-0.0191986, abs=1e-7)
    assert sample.roll_rad == pytest.approx(0.3639011, abs=1e-7)
    assert sample.acceleration_m_s2 == pytest.approx((-3.63827, -0.19613, 9.58110), abs=1e-5)


def test_several_frames_come_oldest_first_ten_milliseconds_apart() -> None:
    imu, line = make()
    line.pending += frame(1, 100) + frame(2, 200) + frame(3, 300)[:5]
    samples = imu.poll()
    assert [s.index for s in samples] == [1, 2]
    assert [s.stamp_ns for s in samples] == [10**9 - 10_000_000, 10**9]
    line.pending += frame(3, 300)[5:]
    assert [s.index for s in imu.poll()] == [3]
    assert imu.poll() == []


def test_lost_frames_are_counted_over_the_wrap_of_the_index() -> None:
    imu, line = make()
    line.pending += frame(254) + frame(1)
    imu.poll()
    assert imu.counters.lost_frames == 2


def test_a_frame_with_a_wrong_sum_is_dropped_and_the_next_one_is_found() -> None:
    imu, line = make()
    bad = bytearray(frame(7, 111))
    bad[8] ^= 0x10
    line.pending += bad + frame(8, 222)
    assert [s.index for s in imu.poll()] == [8]
    assert imu.counters.checksum_errors >= 1
    assert imu.counters.discarded_bytes == FRAME_BYTES
