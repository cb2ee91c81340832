"""Lose and reopen the wheel drives' bus while the control loop goes on, by either protocol."""

from collections.abc import Callable
from dataclasses import replace

import can
import pytest

from drivers.errors import DeviceMissing, WrongDevice
from drivers.odrive import EMULATED_ENDPOINTS
from platforms import load_profile
from sim_twin.can import MemoryBus, MotorMounting, WheelDrive
from sim_twin.can.emulated_drive import EmulatedDrive
from sim_twin.can.free_wheel import FreeWheel, FreeWheelWorld
from sim_twin.can.odrive.axis import ODriveAxis
from vla_deploy.control.output.base_drive import can_wheels
from vla_deploy.robots import RobotDescription, load_robot
from vla_deploy.robots.devices import Drive

TICK_NS = 4_000_000
DRIVES: dict[str, Callable[..., EmulatedDrive]] = {"cia402": WheelDrive, "odrive": ODriveAxis}


def with_drives(robot: RobotDescription, drives: tuple[Drive, ...]) -> RobotDescription:
    can_bus = replace(robot.can_bus, drives=drives)
    return replace(robot, parts=replace(robot.parts, can_bus=can_bus))


class Bench:
    """Two drives, the wheels that own them, and the opener between them."""

    def __init__(self, protocol: str) -> None:
        kind = DRIVES[protocol]
        self.world = FreeWheelWorld(
            [FreeWheel(kind(1)), FreeWheel(kind(2, MotorMounting(sign=-1)))]
        )
        self.missing = False
        butler = load_robot("butler")
        wiring = replace(butler.can_bus, protocol=protocol, endpoints_path=EMULATED_ENDPOINTS)
        self.robot: RobotDescription = replace(butler, parts=replace(butler.parts, can_bus=wiring))
        self.wheels = can_wheels(self.robot, load_profile("desktop"), self, self.world)  # type: ignore[arg-type]

    def can(self, name: str) -> can.BusABC:
        if self.missing:
            raise DeviceMissing("no interface")
        return MemoryBus(self.world.wire)

    def is_lost(self) -> bool:
        return self.wheels.lost

    def run(self, ticks: int, v_m_s: float = 0.0) -> None:
        for _ in range(ticks):
            self.wheels.cycle(v_m_s, 0.0)
            self.world.sleep_until(self.world.now_ns() + TICK_NS)

    def reopen(self, ticks: int) -> bool:
        """Take reopening steps, one per tick, and see that none of them waits."""
        for _ in range(ticks):
            before_ns = self.world.now_ns()
            back = self.wheels.try_reopen()
            assert self.world.now_ns() == before_ns
            if back:
                return True
            self.world.sleep_until(before_ns + TICK_NS)
        return False


@pytest.fixture(params=["cia402", "odrive"])
def bench(request: pytest.FixtureRequest) -> Bench:
    return Bench(request.param)


def test_the_base_drives_by_either_protocol(bench: Bench) -> None:
    bench.wheels.open()
    bench.wheels.enable()
    bench.run(60)
    assert bench.wheels.enabled
    bench.run(250, 0.3)
    assert bench.wheels.velocity.v_m_s == pytest.approx(0.3, abs=0.01)
    assert bench.wheels.odometry.x_m > 0.15
    bench.wheels.close()


def test_a_lost_bus_comes_back_without_a_tick_that_waits(bench: Bench) -> None:
    bench.wheels.open()
    bench.wheels.enable()
    bench.run(60, 0.2)
    bench.world.wire.cut = True
    bench.run(200, 0.2)
    assert bench.is_lost()
    assert not bench.reopen(50)
    bench.world.wire.cut = False
    assert bench.reopen(1500)
    bench.run(50)
    assert not bench.is_lost()
    assert not bench.wheels.enabled
    assert not bench.wheels.faulted
    bench.wheels.close()


def test_bus_off_ends_in_a_new_connection_with_the_drives_disabled(bench: Bench) -> None:
    bench.wheels.open()
    bench.wheels.enable()
    bench.run(60, 0.2)
    bench.world.wire.set_bus_off()
    bench.run(2, 0.2)
    assert bench.is_lost()
    assert "bus-off" in bench.wheels.failure
    bench.world.wire.restart()
    assert bench.reopen(1500)
    bench.run(50)
    assert not bench.wheels.enabled
    assert bench.wheels.failure == ""
    bench.wheels.close()


def test_an_interface_that_stays_away_is_told_and_tried_again(bench: Bench) -> None:
    bench.wheels.open()
    bench.world.wire.cut = True
    bench.run(200)
    bench.missing = True
    assert not bench.reopen(600)
    assert bench.wheels.failure == "no interface"
    bench.missing = False
    bench.world.wire.cut = False
    assert bench.reopen(1500)
    bench.wheels.close()


def test_the_drives_mode_and_gear_come_from_the_robot_file() -> None:
    bench = Bench("cia402")
    drives = [
        replace(drive, mode="cyclic_synchronous_velocity", gear_ratio=3.0)
        for drive in bench.robot.can_bus.drives
    ]
    robot = with_drives(bench.robot, tuple(drives))
    wheels = can_wheels(robot, load_profile("desktop"), bench, bench.world)  # type: ignore[arg-type]
    wheels.open()
    first = bench.world.wheels[0].drive
    assert isinstance(first, WheelDrive)
    assert first._objects.get(0x6060) == 9
    wheels.enable()
    for _ in range(300):
        wheels.cycle(0.2, 0.0)
        bench.world.sleep_until(bench.world.now_ns() + TICK_NS)
    assert bench.world.wheels[0].velocity_rad_s == pytest.approx(3.0 * 0.2 / 0.08, abs=0.1)
    wheels.close()


def test_other_motor_counts_than_declared_are_refused() -> None:
    bench = Bench("cia402")
    drives = tuple(replace(drive, counts_per_rev=4096) for drive in bench.robot.can_bus.drives)
    robot = with_drives(bench.robot, drives)
    wheels = can_wheels(robot, load_profile("desktop"), bench, bench.world)  # type: ignore[arg-type]
    with pytest.raises(WrongDevice, match="encoder increments"):
        wheels.open()


def test_wheels_are_told_by_their_counts_beside_what_was_commanded(bench: Bench) -> None:
    bench.wheels.open()
    bench.wheels.enable()
    bench.run(400, 0.3)
    for sample in bench.wheels.samples():
        assert sample.commanded_rad_s == pytest.approx(0.3 / 0.08)
        assert sample.measured_rad_s == pytest.approx(0.3 / 0.08, abs=0.05)
    bench.world.wheels[1].drive.freeze(True)
    bench.run(30, 0.3)
    left, right = bench.wheels.samples()
    assert left.measured_rad_s == pytest.approx(0.3 / 0.08, abs=0.05)
    assert right.measured_rad_s == 0.0
    bench.wheels.disable()
    bench.run(5)
    assert {sample.commanded_rad_s for sample in bench.wheels.samples()} == {0.0}
    bench.wheels.close()


def test_a_drive_that_runs_away_is_told_by_its_counts(bench: Bench) -> None:
    bench.wheels.open()
    bench.wheels.enable()
    bench.run(60)
    for wheel in bench.world.wheels:
        wheel.drive.run_away(2.0)
    bench.run(300)
    turning = [sample.measured_rad_s for sample in bench.wheels.samples()]
    assert turning == pytest.approx([2.0, 2.0], abs=0.05)
    bench.wheels.disable()
    bench.run(5)
    assert not any(wheel.drive.armed for wheel in bench.world.wheels)
    bench.wheels.close()


def test_a_quick_stop_that_does_not_end_ends_in_no_power(bench: Bench) -> None:
    bench.wheels.open()
    bench.wheels.enable()
    bench.run(100, 0.2)
    wheel = bench.world.wheels[0]
    bench.wheels.quick_stop()
    for _ in range(240):
        wheel.velocity_rad_s = 3.0
        bench.run(1)
    assert wheel.drive.armed
    bench.run(20)
    assert not wheel.drive.armed
    bench.wheels.close()


def test_a_drive_that_was_only_late_brakes_without_a_fault_of_its_own(bench: Bench) -> None:
    bench.wheels.open()
    bench.wheels.enable()
    bench.run(60)
    bench.run(100, 0.3)
    for wheel in bench.world.wheels:
        wheel.drive.silence(on=True)
    bench.run(40, 0.3)
    assert bench.is_lost()
    for wheel in bench.world.wheels:
        wheel.drive.silence(on=False)
    bench.run(190, 0.3)
    assert not any(wheel.drive.faulted for wheel in bench.world.wheels)
    assert [abs(wheel.velocity_rad_s) < 0.1 for wheel in bench.world.wheels] == [True, True]
    bench.wheels.enable()
    bench.run(20, 0.3)
    assert not any(wheel.drive.armed for wheel in bench.world.wheels)
    bench.wheels.close()


def test_a_lost_link_stays_known_while_its_drives_are_still_told_to_stop(bench: Bench) -> None:
    bench.wheels.open()
    bench.run(20)
    bench.world.wire.set_bus_off()
    bench.run(100)
    assert bench.is_lost()
    assert "bus-off" in bench.wheels.failure
    bench.wheels.close()


def test_a_stop_of_category_0_takes_the_power_within_a_tick(bench: Bench) -> None:
    bench.wheels.open()
    bench.wheels.enable()
    bench.run(60)
    bench.run(50, 0.3)
    bench.wheels.cut_power()
    bench.run(1, 0.3)
    assert not any(wheel.drive.armed for wheel in bench.world.wheels)
    bench.wheels.reset_fault()
    bench.run(50)
    assert not bench.wheels.faulted
    bench.wheels.enable()
    bench.run(60)
    assert bench.wheels.enabled
    bench.wheels.close()
