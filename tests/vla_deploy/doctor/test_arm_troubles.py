"""The troubles that owners of an SO-101 meet, made at the wire: doctor names each before torque.

Where control must not start with one, connecting is refused by the same name.
"""

import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import pytest

from drivers.clock import NS_PER_S
from drivers.errors import DeviceBusy, DriverError
from drivers.feetech.codec import FeetechInstruction, FeetechPacket, FeetechParser
from drivers.servo.fault_policy import FaultPolicy
from drivers.servo.hardware_error import HardwareError
from sim_twin.ports.lines import MemoryLine
from sim_twin.servos import EmulatedServoSpec
from sim_twin.servos.feetech import EmulatedFeetechSpec
from sim_twin.servos.server import FreeBank, FreeFeetechServos, FreeServos
from vla_deploy.doctor import FindingLevel
from vla_deploy.doctor.devices import device_files, latency_timers
from vla_deploy.doctor.servos import port_users, servos_on_the_bus
from vla_deploy.robots import RobotDescription, load_robot
from vla_deploy.robots.calibration.calibration import (
    CALIBRATION_FILE,
    JointCalibration,
    LeRobotOrigin,
    write_calibration,
)
from vla_deploy.robots.servos.declared import bus_family, servo_specs

SO101, KOCH = load_robot("so101"), load_robot("koch_v1_1")
FAIL, WARN, OK, MISSING = (
    FindingLevel.FAIL,
    FindingLevel.WARN,
    FindingLevel.OK,
    FindingLevel.MISSING,
)
WRITES = {
    FeetechInstruction.WRITE,
    FeetechInstruction.REG_WRITE,
    FeetechInstruction.SYNC_WRITE,
    FeetechInstruction.REBOOT,
    FeetechInstruction.RESTORE,
}


class ArmLine(MemoryLine):
    """The line to an arm that lies at rest; its speed can be set, and it knows what was sent."""

    bauds = (115_200, 500_000, 1_000_000)

    def __init__(self, robot: RobotDescription, free: FreeBank) -> None:
        super().__init__(free.bank, self)
        self.free = free
        self.bank = free.bank
        self.sent: list[FeetechPacket] = []
        self._parser = FeetechParser()
        self.time_ns = 10 * NS_PER_S
        for row, servo in enumerate(servo_specs(robot)):
            pulse = servo.to_pulse(robot.poses["rest"][servo.joint])
            free.rotors.position_rad[row] = (pulse - servo.centre_pulse) * servo.pulse_rad
        self.settle()

    def settle(self) -> None:
        self.time_ns += NS_PER_S // 10
        self.free.advance_to(self.time_ns)

    def now_ns(self) -> int:
        return self.time_ns

    def sleep_until(self, deadline_ns: int) -> None:
        self.time_ns = max(self.time_ns, deadline_ns)

    def write(self, data: bytes) -> None:
        self.sent += self._parser.feed(data)
        super().write(data)

    def set_baud(self, baud: int) -> None:
        self.bank.set_host_baud(baud)

    def open(self, _path: Path, baud: int, _clock: object) -> "ArmLine":
        self.set_baud(baud)
        return self


def so101(
    eeprom: Mapping[int, Mapping[str, int]] | None = None, models: Mapping[int, str] | None = None
) -> ArmLine:
    eeprom, models = eeprom or {}, models or {}
    specs = [
        EmulatedFeetechSpec(
            id=one.id, model_name=models.get(one.id, one.model), eeprom=eeprom.get(one.id, {})
        )
        for one in SO101.servo_bus.servos
    ]
    free = FreeFeetechServos(specs)
    free.supply_v = 12.0
    return ArmLine(SO101, free)


def koch(eeprom: Mapping[int, Mapping[str, int]]) -> ArmLine:
    specs = [
        EmulatedServoSpec(
            id=one.id, model_name=one.model, eeprom={"baud_rate": 3, **eeprom.get(one.id, {})}
        )
        for one in KOCH.servo_bus.servos
    ]
    return ArmLine(KOCH, FreeServos(specs))


def poke(line: ArmLine, servo_id: int, address: int, *data: int) -> None:
    """Let another program write to a servo's table."""
    frame = [servo_id, len(data) + 3, FeetechInstruction.WRITE, address, *data]
    line.write(bytes([0xFF, 0xFF, *frame, ~sum(frame) & 0xFF]))
    line.discard_input()
    line.sent.clear()


def powered(supply_v: float) -> ArmLine:
    line = so101()
    line.free.supply_v = supply_v
    line.settle()
    return line


def given_id(old: int, new: int) -> ArmLine:
    line = so101()
    poke(line, old, 5, new)
    return line


def swapped(one: int, other: int) -> ArmLine:
    """Exchange two shafts: what the wire shows when two ids are exchanged."""
    line = so101()
    rows = [one - 1, other - 1]
    line.free.rotors.position_rad[rows] = line.free.rotors.position_rad[rows[::-1]]
    line.settle()
    return line


def turned(servo_id: int, angle_rad: float) -> ArmLine:
    line = so101()
    line.free.rotors.position_rad[servo_id - 1] = angle_rad
    line.settle()
    return line


def alerted(error: HardwareError) -> ArmLine:
    line = so101()
    line.bank.set_alert(3, error)
    return line


def unlocked() -> ArmLine:
    line = so101()
    poke(line, 2, 55, 0)
    return line


def silent(*ids: int) -> ArmLine:
    line = so101()
    for one in ids:
        line.bank.silence(one)
    return line


@dataclass(frozen=True, kw_only=True)
class Trouble:
    """One row: the arm with its trouble, what doctor says of it, and what connecting says."""

    make: Callable[[], ArmLine]
    level: FindingLevel
    says: tuple[str, ...]
    try_: str = ""
    connect: str = ""
    robot: RobotDescription = field(default=SO101)


NARROW = {"min_position_limit": 1500, "max_position_limit": 2600}
TROUBLES = {
    "as it should be": Trouble(make=so101, level=OK, says=("6 of 6 at 1000000 baud, 12.0 V",)),
    "a supply too low": Trouble(
        make=lambda: powered(5.0),
        level=FAIL,
        says=("servo 1 (shoulder_pan) has 5.0 V, expected 9.0..14.0 V", "servo 6 (gripper)"),
        try_="check converter, plugs",
    ),
    "7.4 V servos declared, 12 V fed": Trouble(
        make=so101,
        robot=replace(
            SO101,
            servo_bus=replace(
                SO101.servo_bus,
                servos=tuple(replace(one, model="STS3215-C001") for one in SO101.servo_bus.servos),
            ),
        ),
        level=FAIL,
        says=("expected a supply of 4 to 8.4 V, got 12.0 V",),
        try_="disconnect it before it is damaged",
        connect="expected a supply of 4 to 8.4 V, got 12.0 V",
    ),
    "a 7.4 V servo among those for 12 V": Trouble(
        make=lambda: so101({4: {"max_voltage_limit": 80}}),
        level=FAIL,
        says=("servo 4 (wrist_flex, STS3215-C018): expected max_voltage_limit 14.0 V", "got 8.0 V"),
        try_="read the label",
    ),
    "old firmware": Trouble(
        make=lambda: so101({5: {"firmware_minor": 9}}),
        level=FAIL,
        says=("servo 5 (wrist_roll, STS3215-C018): firmware 3.10 or newer is needed, got 3.9",),
        try_="FD software",
        connect="firmware 3.10 or newer is needed, got 3.9",
    ),
    "firmware of two versions": Trouble(
        make=lambda: so101({5: {"firmware_minor": 11}}),
        level=FAIL,
        says=("different firmware", "3.11: wrist_roll"),
        connect="different firmware",
    ),
    "one id twice": Trouble(
        make=lambda: given_id(3, 2),
        level=FAIL,
        says=("the answers of id 2 are damaged: more than one servo has it",),
        try_="vla-deploy servo set-id",
        connect="look for a second servo of this id",
    ),
    "an id never set": Trouble(
        make=lambda: given_id(3, 1),
        level=FAIL,
        says=("the answers of id 1 are damaged",),
        try_="vla-deploy servo setup --joint elbow_flex",
        connect="look for a second servo of this id",
    ),
    "a servo that no joint has": Trouble(
        make=lambda: given_id(3, 9),
        level=WARN,
        says=("servo 9, STS3215, answers, but the robot file has no servo of this id",),
        connect=r"no answer from servo 3 \(elbow_flex",
    ),
    "a servo missing": Trouble(
        make=lambda: silent(3),
        level=FAIL,
        says=("no answer from servo 3 (elbow_flex)",),
        try_="check power, cable and id",
        connect=r"no answer from servo 3 \(elbow_flex",
    ),
    "all missing": Trouble(
        make=lambda: silent(1, 2, 3, 4, 5, 6),
        level=FAIL,
        says=("no servo answers at 1000000, 500000, 115200 baud",),
        try_="check power, cable and port",
        connect="no answer from servo 1",
    ),
    "ids exchanged": Trouble(
        make=lambda: swapped(2, 3),
        level=WARN,
        says=("servo 2 (shoulder_lift) stands at 1.61", "servo 3 (elbow_flex) stands at -1.61"),
        try_="move shoulder_lift by hand and see which id follows",
    ),
    "a joint where it cannot be": Trouble(
        make=lambda: turned(4, 2.5),
        level=WARN,
        says=("servo 4 (wrist_flex) stands at 2.50, limits -1.628..1.628: outside",),
        try_="vla-deploy servo calibrate",
    ),
    "a latched overload": Trouble(
        make=lambda: alerted(HardwareError.OVERLOAD),
        level=FAIL,
        says=("servo 3 (elbow_flex, STS3215-C018): reports overload",),
        try_="vla-deploy servo reboot 3",
    ),
    "an error of the voltage": Trouble(
        make=lambda: alerted(HardwareError.INPUT_VOLTAGE),
        level=FAIL,
        says=("reports input voltage",),
    ),
    "another speed": Trouble(
        make=lambda: so101({4: {"baud_rate": 1}}),
        level=FAIL,
        says=("no answer at 1000000 baud from servo 4 (wrist_flex), but at 500000 baud",),
        try_="vla-deploy servo set-baud 1000000 4 --baud 500000",
        connect="servo 4 answers at 500000 baud: set it to 1000000",
    ),
    "an open EEPROM": Trouble(
        make=unlocked, level=WARN, says=("servo 2: expected lock 1, got 0",), try_="locks it"
    ),
    "a homing offset": Trouble(
        make=lambda: so101({3: {"homing_offset": -50}}),
        level=WARN,
        says=("homing offsets are set", "elbow_flex -50"),
        try_="vla-deploy servo calibration import",
    ),
    "another model": Trouble(
        make=lambda: so101(models={6: "STS3250"}),
        level=FAIL,
        says=("servo 6 (gripper) is STS3250, the robot file says STS3215-C018",),
        try_="correct the robot file or the wiring",
        connect=r"expected model 777, got 2825 \(STS3250\)",
    ),
    "an SCS among STS": Trouble(
        make=lambda: so101(models={6: "SCS0009"}),
        level=FAIL,
        says=("servo 6 (gripper) is SCS0009, the robot file says STS3215-C018",),
        connect=r"expected model 777, got 1284 \(SCS0009\)",
    ),
    "limits of its own": Trouble(
        make=lambda: so101({2: NARROW}),
        level=FAIL,
        says=(
            "servo 2 (shoulder_lift, STS3215-C018): expected position limits 930..3166 or wider",
            "got 1500..2600",
        ),
        try_="vla-deploy servo set-limits 2",
        connect=r"got 1500\.\.2600 in the servo, which clips the rest",
    ),
    "limits of its own, Dynamixel": Trouble(
        robot=KOCH,
        make=lambda: koch({2: NARROW}),
        level=FAIL,
        says=("servo 2 (shoulder_lift, XL430-W250): expected position limits", "got 1500..2600"),
        connect=r"got 1500\.\.2600 in the servo, which clips the rest",
    ),
}


@pytest.mark.parametrize("row", TROUBLES.values(), ids=TROUBLES)
def test_doctor_names_the_trouble_and_writes_nothing(computer: Any, row: Trouble) -> None:
    line = row.make()
    computer.write(row.robot.servo_bus.path)
    context = replace(computer.context(), robot=row.robot, clock=line, open_serial=line.open)
    found = list(servos_on_the_bus(context))
    about = [one for one in found if all(words in one.measured for words in row.says)]
    assert [one.level for one in about[:1]] == [row.level], found
    assert row.try_ in about[0].remedy
    assert (row.level is OK) == (len(found) == 1 and found[0].level is OK)
    assert not [one for one in line.sent if one.code in WRITES]


@pytest.mark.parametrize("row", TROUBLES.values(), ids=TROUBLES)
def test_connecting_is_refused_by_the_same_name(row: Trouble) -> None:
    line, family = row.make(), bus_family(row.robot)
    line.set_baud(1_000_000)
    servos = servo_specs(row.robot)
    bus = family.bus(line, line, servos, baud=1_000_000, watchdog_s=0.1, fault_policy=FaultPolicy())
    if row.connect:
        with pytest.raises(DriverError, match=row.connect):
            bus.connect()
    else:
        bus.connect()


@pytest.mark.parametrize(("held", "level"), [(-50, OK), (-80, FAIL)])
def test_a_homing_offset_that_was_changed_since_calibration_is_named(
    computer: Any, tmp_path: Path, held: int, level: FindingLevel
) -> None:
    origin = LeRobotOrigin(
        drive_mode=0, homing_offset=-50, range_min=900, range_max=3200, homing_in_servo=True
    )
    calibration = JointCalibration(
        servo_id=3, sign=1, offset=0.0, method="lerobot", made_at="2026-11-30", lerobot=origin
    )
    write_calibration(tmp_path / CALIBRATION_FILE, {"elbow_flex": calibration})
    computer.write(SO101.servo_bus.path)
    line = so101({3: {"homing_offset": held}})
    robot = replace(SO101, folder=tmp_path)
    context = replace(computer.context(), robot=robot, clock=line, open_serial=line.open)
    (finding,) = servos_on_the_bus(context)
    assert finding.level is level
    assert level is OK or "expected homing offset -50, as calibrated, got -80" in finding.measured


def process(computer: Any, pid: int, name: str, *files: Path) -> None:
    computer.write(f"/proc/{pid}/comm", f"{name}\n")
    folder = computer.root / "proc" / str(pid) / "fd"
    folder.mkdir()
    for number, file in enumerate(files):
        (folder / str(number)).symlink_to(file)


def test_a_port_that_another_program_has_is_left_alone(computer: Any) -> None:
    port = computer.write(SO101.servo_bus.path)
    process(computer, 71, "lerobot-record", port)
    process(computer, 72, "ModemManager")
    process(computer, os.getpid(), "doctor", port)
    line = so101()
    context = replace(computer.context(robot="so101"), open_serial=line.open)
    held, grabber = port_users(context)
    assert "lerobot-record (process 71)" in held.measured
    assert grabber.remedy == "sudo systemctl disable --now ModemManager"
    (finding,) = servos_on_the_bus(context)
    assert (finding.level, line.sent) == (MISSING, [])


def test_a_running_robot_keeps_its_bus(computer: Any) -> None:
    computer.write(SO101.servo_bus.path)

    def busy(path: Path, _baud: int, _clock: object) -> ArmLine:
        raise DeviceBusy(f"{path}: stop the process that holds it")

    context = replace(computer.context(robot="so101"), open_serial=busy)
    (finding,) = servos_on_the_bus(context)
    assert (finding.level, "holds it" in finding.measured) == (MISSING, True)


def test_a_wrong_port_and_a_late_adapter_are_named(computer: Any) -> None:
    other = computer.write("/dev/serial/by-id/usb-FTDI_FT232R_A1-if00-port0")
    assert not list(servos_on_the_bus(computer.context(robot="so101")))
    named = next(one for one in device_files(computer.context(robot="so101")))
    assert (named.level, other.name in named.measured) == (FAIL, True)
    computer.write("/sys/bus/usb-serial/devices/ttyUSB0/latency_timer", "16\n")
    (late,) = latency_timers(computer.context(robot="so101"))
    assert (late.level, "16 ms, expected 1 ms" in late.measured) == (FAIL, True)
