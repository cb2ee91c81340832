import math
import struct

import numpy as np
import pytest

from drivers.lidar.ld19 import PACKET_BYTES, Ld19, crc8
from sim_twin.contracts.scripted import ManualClock, ScriptedLine

# LD19 Development Manual, section 4: the example packet.
GOLDEN = bytes.fromhex(
    "542c6808ab7ee000e4dc00e2d900e5d500e3d300e4d000e9cd00e4ca00e2c700e9c500e5c200e5c000e5be823a1a50"
)
GOLDEN_MM = [224, 220, 217, 213, 211, 208, 205, 202, 199, 197, 194, 192]


def packet(
    start_deg: float, distances_mm: list[int], stamp_ms: int, step_deg: float = 0.8
) -> bytes:
    """Encode independently of the driver, straight from the manual's table."""
    points = b"".join(struct.pack("<HB", d, 180) for d in distances_mm)
    start = round(start_deg * 100) % 36000
    end = round((start_deg + 11 * step_deg) * 100) % 36000
    body = struct.pack("<BBHH", 0x54, 0x2C, 3600, start) + points
    body += struct.pack("<HH", end, stamp_ms)
    crc = 0
    for byte in body:
        crc ^= byte
        for _ in range(8):
            crc = (crc << 1) ^ 0x4D if crc & 0x80 else crc << 1
        crc &= 0xFF
    return body + bytes([crc])


def turn(distance_mm: int, first_ms: int = 0) -> list[bytes]:
    """Return one turn: 30 packets of 12 points, 1 degree and 0.28 ms apart."""
    return [
        packet(12.0 * i, [distance_mm] * 12, (first_ms + i * 10 // 3) % 30000, 1.0)
        for i in range(30)
    ]


def turn_and_next(distance_mm: int) -> list[bytes]:
    """Return one turn and the packet after it, which ends the turn for the driver."""
    return [*turn(distance_mm), turn(distance_mm, 100)[0]]


def make() -> tuple[Ld19, ScriptedLine, ManualClock]:
    line, clock = ScriptedLine(), ManualClock(10**9)
    return Ld19(line, clock), line, clock


def feed_turns(line: ScriptedLine, packets: list[bytes]) -> None:
    for data in packets:
        line.pending += data


def test_the_manuals_example_has_the_right_checksum() -> None:
    assert len(GOLDEN) == PACKET_BYTES
    assert crc8(GOLDEN[:-1]) == GOLDEN[-1]


def test_the_manuals_example_lands_on_the_beams_counter_clockwise_of_its_angles() -> None:
    lidar, line, _ = make()
    packets = turn(1000)
    # The golden packet runs from 324.27 to 334.70 degrees clockwise.
    packets[27] = GOLDEN
    feed_turns(line, [*packets, turn(1000)[0]])
    scan = lidar.poll()
    assert scan is not None
    step_deg = (334.70 - 324.27) / 11
    for i, mm in enumerate(GOLDEN_MM):
        beam = round(-(324.27 + i * step_deg)) % 360
        assert scan.range_m[beam] == pytest.approx(mm / 1000.0)


def test_a_whole_turn_becomes_one_scan() -> None:
    lidar, line, _ = make()
    feed_turns(line, turn_and_next(2500))
    scan = lidar.poll()
    assert scan is not None
    assert np.all(scan.range_m == np.float32(2.5))
    assert scan.turn_hz == 10.0
    assert lidar.counters.packets == 31
    assert lidar.poll() is None


def test_the_mounting_yaw_turns_the_scan_to_the_robots_front() -> None:
    line = ScriptedLine()
    lidar = Ld19(line, ManualClock(10**9), mounting_yaw_rad=math.pi / 2)
    packets = turn_and_next(3000)
    packets[0] = packet(0.0, [500] * 12, 0, 1.0)
    feed_turns(line, packets)
    scan = lidar.poll()
    assert scan is not None
    near = np.flatnonzero(scan.range_m == np.float32(0.5))
    assert near.min() == 79
    assert near.max() == 90


def test_no_return_stays_zero_and_the_nearer_of_two_points_on_a_beam_wins() -> None:
    lidar, line, _ = make()
    packets = turn_and_next(1000)
    packets[3] = packet(36.0, [0] * 12, 10, 1.0)
    packets[5] = packet(60.0, [900, 700] * 6, 17, 0.02)
    feed_turns(line, packets)
    scan = lidar.poll()
    assert scan is not None
    assert np.all(scan.range_m[[-36, -47]] == 0.0)
    assert scan.range_m[-60] == np.float32(0.7)


def test_the_newest_of_several_scans_is_returned() -> None:
    lidar, line, _ = make()
    feed_turns(line, turn(1000) + turn_and_next(2000))
    scan = lidar.poll()
    assert scan is not None
    assert np.all(scan.range_m == np.float32(2.0))
    assert lidar.counters.scans == 2


def test_a_corrupt_packet_is_counted_and_its_beams_stay_empty() -> None:
    lidar, line, _ = make()
    packets = turn_and_next(1000)
    packets[10] = packets[10][:20] + bytes([packets[10][20] ^ 1]) + packets[10][21:]
    feed_turns(line, packets)
    scan = lidar.poll()
    assert scan is not None
    assert lidar.counters.crc_errors >= 1
    assert lidar.counters.discarded_bytes == PACKET_BYTES
    assert np.count_nonzero(scan.range_m == 0.0) == 12


def test_a_turn_with_too_many_holes_is_no_scan() -> None:
    lidar, line, _ = make()
    feed_turns(line, turn(1000) + turn(1000, 100)[:20] + turn_and_next(1000))
    lidar.poll()
    assert lidar.counters.scans == 2
    assert lidar.counters.incomplete_scans == 1


def test_the_sides_of_a_gap_in_time_are_not_glued_into_one_scan() -> None:
    lidar, line, clock = make()
    feed_turns(line, turn(1000) + turn(1000, 100)[:15])
    lidar.poll()
    clock.ns += 3 * 10**9
    feed_turns(line, turn(2000, 3100)[15:] + turn_and_next(3000))
    scan = lidar.poll()
    assert scan is not None
    assert np.all(scan.range_m == np.float32(3.0))
    assert lidar.counters.scans == 2
    assert lidar.counters.incomplete_scans == 2


def test_stamps_are_the_time_of_measurement_and_survive_the_wrap() -> None:
    lidar, line, clock = make()
    scans = []
    for t in range(4):
        for i, data in enumerate(turn(1000, 29_850 + 100 * t)):
            clock.ns = 10**9 + (100 * t + i * 10 // 3) * 10**6
            line.pending += data
            scans += [s for s in [lidar.poll()] if s is not None]
    assert [s.stamp_ns for s in scans] == [10**9 + (96 + 100 * t) * 10**6 for t in range(3)]
    for scan in scans:
        assert scan.beam_stamp_ns[0] == scan.stamp_ns - 96 * 10**6
        assert scan.beam_stamp_ns[180] == scan.stamp_ns - 46 * 10**6
        assert scan.beam_stamp_ns[1] == scan.stamp_ns
