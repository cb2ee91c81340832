"""Drive the whole robot in MuJoCo with other gears and encoders than it was delivered with."""

from dataclasses import replace

import can
import pytest

from drivers.odrive import EMULATED_ENDPOINTS
from platforms import load_profile
from sim_twin.can import MemoryBus
from sim_twin.timing.clock import SimClock
from sim_twin.twin import Twin
from vla_deploy.control.output.wheels import Wheels
from vla_deploy.robots import load_robot

TICK_NS = 4_000_000
TICKS = 250


class Bench:
    def __init__(self, protocol: str, gear_ratio: float, counts_per_rev: int) -> None:
        butler = load_robot("butler")
        drives = tuple(
            replace(drive, gear_ratio=gear_ratio, counts_per_rev=counts_per_rev)
            for drive in butler.can_bus.drives
        )
        wiring = replace(
            butler.can_bus, protocol=protocol, drives=drives, endpoints_path=EMULATED_ENDPOINTS
        )
        robot = replace(butler, can_bus=wiring)
        self.twin = Twin(robot)
        self.clock = SimClock(self.twin)
        self.wheels = Wheels(robot, load_profile("desktop"), self, self.clock)  # type: ignore[arg-type]

    def can(self, name: str) -> can.BusABC:
        return MemoryBus(self.twin.can_wire)

    def drive(self, ticks: int, v_m_s: float) -> None:
        for _ in range(ticks):
            self.wheels.cycle(v_m_s, 0.0)
            self.clock.sleep_until(self.clock.now_ns() + TICK_NS)


@pytest.mark.parametrize(
    ("protocol", "gear_ratio", "counts_per_rev"),
    [("cia402", 1.0, 16384), ("cia402", 12.0, 4096), ("odrive", 12.0, 8192)],
)
def test_the_base_goes_as_far_by_any_gear(
    protocol: str, gear_ratio: float, counts_per_rev: int
) -> None:
    bench = Bench(protocol, gear_ratio, counts_per_rev)
    bench.wheels.open()
    bench.wheels.enable()
    bench.drive(60, 0.0)
    bench.drive(TICKS, 0.3)
    assert bench.wheels.v_m_s == pytest.approx(0.3, abs=0.02)
    assert bench.wheels.odometry.x_m == pytest.approx(0.27, abs=0.02)
    assert not bench.wheels.faulted
    bench.wheels.close()
