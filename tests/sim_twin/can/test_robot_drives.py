"""Drive a robot's wheels with the encoder, the gear and the files of its robot file."""

import configparser
import json
import math
from dataclasses import replace
from pathlib import Path

import can
import pytest

from drivers.canopen import EDS_PATH
from drivers.clock import Clock
from drivers.errors import WrongDevice
from drivers.odrive import EMULATED_ENDPOINTS
from platforms import load_profile
from sim_twin.can import (
    CanWire,
    EmulatedDrive,
    MemoryBus,
    MotorMounting,
    ODriveAxis,
    WheelDrive,
    robot_drives,
)
from sim_twin.can.free_wheel import FreeWheel, FreeWheelWorld
from sim_twin.can.power_stage import MotorSpec
from sim_twin.timing.clock import SimClock
from sim_twin.twin import Twin
from vla_deploy.control.output.base_drive import can_wheels
from vla_deploy.robots import RobotDescription, load_robot

TICK_NS = 4_000_000
BUTLER = load_robot("butler")


def robot_with(
    protocol: str, gear_ratio: float, counts_per_rev: int, **files: Path
) -> RobotDescription:
    drives = tuple(
        replace(drive, gear_ratio=gear_ratio, counts_per_rev=counts_per_rev)
        for drive in BUTLER.can_bus.drives
    )
    return replace(
        BUTLER,
        parts=replace(
            BUTLER.parts,
            can_bus=replace(BUTLER.can_bus, protocol=protocol, drives=drives, **files),
        ),
    )


class Bench:
    """Control's wheels on a wire, and the clock that moves what is at its other end."""

    def __init__(self, robot: RobotDescription, clock: Clock, wire: CanWire) -> None:
        self.clock, self.wire = clock, wire
        self.wheels = can_wheels(robot, load_profile("desktop"), self, clock)  # type: ignore[arg-type]

    def can(self, name: str) -> can.BusABC:
        return MemoryBus(self.wire)

    def drive(self, ticks: int, v_m_s: float) -> None:
        for _ in range(ticks):
            self.wheels.cycle(v_m_s, 0.0)
            self.clock.sleep_until(self.clock.now_ns() + TICK_NS)

    def set_off(self) -> None:
        """Enable the wheels, then drive a second at 0.3 m/s."""
        self.wheels.open()
        self.wheels.enable()
        self.drive(60, 0.0)
        self.drive(250, 0.3)


class FreeBench(Bench):
    """Wheels that turn freely, without any physics."""

    def __init__(self, robot: RobotDescription) -> None:
        self.world: FreeWheelWorld[EmulatedDrive] = FreeWheelWorld(
            [FreeWheel(drive) for drive in robot_drives(robot.can_bus)]
        )
        super().__init__(robot, self.world, self.world.wire)


def written_eds(tmp_path: Path, *, without: tuple[str, ...] = (), **values: str) -> Path:
    eds = configparser.ConfigParser(interpolation=None)
    eds.optionxform = str  # type: ignore[assignment,method-assign]
    eds.read(EDS_PATH)
    for section in without:
        eds.remove_section(section)
    for section, default in values.items():
        eds[section.removeprefix("_")]["DefaultValue"] = default
    path = tmp_path / "vendor.eds"
    with path.open("w") as file:
        eds.write(file)
    return path


def written_endpoints(tmp_path: Path, firmware: str) -> Path:
    document = json.loads(EMULATED_ENDPOINTS.read_text())
    document["fw_version"] = firmware
    for row in document["endpoints"].values():
        row["id"] += 300
    document["endpoints"]["axis0.motor.foo"] = {"id": 7, "type": "float", "access": "rw"}
    path = tmp_path / "flat_endpoints.json"
    path.write_text(json.dumps(document))
    return path


@pytest.mark.parametrize("protocol", ["cia402", "odrive"])
@pytest.mark.parametrize(
    ("gear_ratio", "counts_per_rev"), [(1.0, 4096), (10.0, 2048), (0.5, 16384)]
)
def test_a_base_with_another_gear_and_encoder_drives_as_fast(
    protocol: str, gear_ratio: float, counts_per_rev: int
) -> None:
    bench = FreeBench(
        robot_with(protocol, gear_ratio, counts_per_rev, endpoints_path=EMULATED_ENDPOINTS)
    )
    bench.set_off()
    wheel_rad_s = 0.3 / BUTLER.base.wheel_radius_m
    for wheel, drive in zip(bench.world.wheels, BUTLER.can_bus.drives, strict=True):
        assert abs(wheel.velocity_rad_s) == pytest.approx(wheel_rad_s, abs=0.1), drive.joint
    assert bench.wheels.velocity.v_m_s == pytest.approx(0.3, abs=0.02)
    travelled_m = bench.world.wheels[0].position_rad * BUTLER.base.wheel_radius_m
    assert bench.wheels.odometry.x_m == pytest.approx(travelled_m, abs=0.01)
    bench.wheels.close()


@pytest.mark.parametrize(
    ("protocol", "gear_ratio", "counts_per_rev"), [("cia402", 12.0, 4096), ("odrive", 12.0, 8192)]
)
def test_the_whole_robot_goes_as_far_with_other_gears(
    protocol: str, gear_ratio: float, counts_per_rev: int
) -> None:
    robot = robot_with(protocol, gear_ratio, counts_per_rev, endpoints_path=EMULATED_ENDPOINTS)
    twin = Twin(robot)
    bench = Bench(robot, SimClock(twin), twin.can_wire)
    bench.set_off()
    assert bench.wheels.velocity.v_m_s == pytest.approx(0.3, abs=0.02)
    assert bench.wheels.odometry.x_m == pytest.approx(0.27, abs=0.02)
    assert not bench.wheels.faulted
    bench.wheels.close()


@pytest.mark.parametrize("kind", [WheelDrive, ODriveAxis])
def test_a_gear_changes_neither_the_torque_nor_the_speed_of_the_wheel(
    kind: type[EmulatedDrive],
) -> None:
    hub, geared = MotorSpec(), MotorSpec().behind_gear(8.0)
    assert geared.torque_limit_nm * 8.0 == pytest.approx(hub.torque_limit_nm)
    assert geared.current_limit_a == pytest.approx(hub.current_limit_a)
    no_load = [spec.supply_v / spec.torque_nm_per_a for spec in (hub, geared)]
    assert no_load[1] == pytest.approx(8.0 * no_load[0])
    assert kind(1, MotorMounting(gear_ratio=8.0))._stage.spec == geared


def test_the_encoder_counts_the_motors_turns() -> None:
    drive = WheelDrive(1, MotorMounting(counts_per_rev=1000, gear_ratio=5.0, sign=-1))
    drive.advance(0, 0.0, 0.0)
    drive.advance(2_000_000, math.tau, 0.0)
    assert drive._objects.get(0x6064) == -5000


def test_a_drive_shows_the_identity_and_the_objects_of_its_eds_file(tmp_path: Path) -> None:
    path = written_eds(
        tmp_path, without=("6077", "6076", "605E"), _1018sub1="0x1234", _1018sub2="0x77"
    )
    bench = FreeBench(robot_with("cia402", 2.0, 4096, eds_path=path))
    bench.set_off()
    assert bench.wheels.velocity.v_m_s == pytest.approx(0.3, abs=0.02)
    first = bench.world.wheels[0].drive
    assert isinstance(first, WheelDrive)
    assert first._objects.read(0x1018, 1) == (0x1234).to_bytes(4, "little")
    assert not first._objects.has((0x6077, 0))
    bench.wheels.close()


def test_a_drive_that_is_not_the_eds_files_is_refused(tmp_path: Path) -> None:
    bench = FreeBench(robot_with("cia402", 1.0, 16384))
    other = robot_with("cia402", 1.0, 16384, eds_path=written_eds(tmp_path, _1018sub2="0x77"))
    wheels = can_wheels(other, load_profile("desktop"), bench, bench.world)  # type: ignore[arg-type]
    with pytest.raises(WrongDevice, match="product"):
        wheels.open()


def test_event_driven_process_data_of_a_vendors_file_are_made_synchronous(tmp_path: Path) -> None:
    path = written_eds(tmp_path, _1800sub2="255", _1801sub2="254")
    bench = FreeBench(robot_with("cia402", 1.0, 16384, eds_path=path))
    bench.wheels.open()
    bench.drive(20, 0.0)
    assert bench.wheels.state is not None
    assert bench.wheels.state.healthy
    bench.wheels.close()


def test_an_axis_has_the_firmware_and_the_numbers_of_its_endpoint_file(tmp_path: Path) -> None:
    path = written_endpoints(tmp_path, "0.6.10")
    bench = FreeBench(robot_with("odrive", 4.0, 8192, endpoints_path=path))
    bench.wheels.open()
    bench.wheels.enable()
    bench.drive(60, 0.0)
    assert bench.wheels.enabled
    first = bench.world.wheels[0].drive
    assert isinstance(first, ODriveAxis)
    first.properties.write_number(7, b"\x00\x00\x80\x3f")
    assert first.properties.read("axis0.motor.foo") == 1.0
    bench.wheels.close()


@pytest.mark.parametrize("firmware", ["0.6", "0.6.x", "0.6.999", "-1.0.0"])
def test_a_firmware_version_that_cannot_be_encoded_is_refused(
    tmp_path: Path, firmware: str
) -> None:
    with pytest.raises(ValueError, match="three numbers"):
        ODriveAxis(1, endpoints_path=written_endpoints(tmp_path, firmware))
