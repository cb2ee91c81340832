"""Work on single servos at the bench, without a robot file."""

from drivers.dynamixel.tools.bench_link import BenchLink, FoundServo
from drivers.dynamixel.tools.scan import SpeedReport, scan_speed

__all__ = ["BenchLink", "FoundServo", "SpeedReport", "scan_speed"]
