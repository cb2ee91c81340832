"""Calibrate emulated arms by driving their joints against their stops; nobody moves a joint."""

import shutil
import signal
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest

from drivers.base import ByteTransport
from drivers.clock import NS_PER_S
from drivers.dynamixel.tables.control_table import PULSE_RAD
from drivers.errors import LinkLost
from drivers.servo.family import family_of
from drivers.servo.tools.bench import ServoBench
from sim_twin.ports.lines import MemoryLine
from sim_twin.servos.server import FreeRobotServos
from sim_twin.timing.clock import SimClock
from sim_twin.twin import Twin
from vla_deploy.cli.devices.servo_bus import ServoBusPort
from vla_deploy.cli.devices.servo_calibrate import calibrate
from vla_deploy.cli.errors import CommandFailed, UsageError
from vla_deploy.cli.main import parser
from vla_deploy.robots import load_robot
from vla_deploy.robots.calibration.calibration import CALIBRATION_FILE, read_calibration
from vla_deploy.robots.loader import ROBOTS_DIR

HORN_OFF_PULSES = 30
OFF_RAD = HORN_OFF_PULSES * PULSE_RAD
FULL = {"so101": ("torque_limit", 1000), "koch_v1_1": ("goal_pwm", 885)}


@dataclass
class Wire:
    """Carry bytes and let time pass; after `ends_after` transactions `ending` is raised."""

    line: ByteTransport
    ends_after: int = 10**9
    ending: BaseException = field(default_factory=lambda: LinkLost("the adapter is gone"))
    keeps_ending: bool = True

    def __getattr__(self, name: str) -> Any:
        return getattr(self.line, name)

    def write(self, data: bytes) -> None:
        self.ends_after -= 1
        if self.ends_after == 0 or (self.ends_after < 0 and self.keeps_ending):
            raise self.ending
        self.line.write(data)


class Arm:
    """Be an arm's servos on a bench, whose horns sit wrong."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.robot = load_robot(folder)
        self.free = FreeRobotServos(self.robot, horn_off_pulses=HORN_OFF_PULSES)
        self.told: list[str] = []
        self.time_ns = 0
        self.sleep_until(NS_PER_S)
        self.wire = Wire(MemoryLine(self.free.bank, self))

    def now_ns(self) -> int:
        return self.time_ns

    def sleep_until(self, deadline_ns: int) -> None:
        self.time_ns = max(self.time_ns, deadline_ns)
        self.free.advance_to(self.time_ns)

    def tell(self, text: str) -> None:
        self.told.append(text)

    def wait(self, text: str, meanwhile: Callable[[], None]) -> None:
        raise AssertionError(f"nobody is there to {text}")

    def row(self, joint: str) -> int:
        return self.robot.joint_index[joint]

    def holds(self, joint: str, name: str) -> int:
        return self.free.bank.register(self.robot.servo_bus.servos[self.row(joint)].id, name)

    def bench(self) -> ServoBench:
        bus = self.robot.servo_bus
        return family_of(bus.servos[0].model).bench(self.wire, self, bus.baud)

    def calibrate(self, *words: str) -> int:
        command = ["servo", "calibrate", "--robot", str(self.folder), "--method", "stops", "--yes"]
        port = ServoBusPort(port=Path("bench"), baud=1_000_000, robot=self.robot, clock=self)
        arguments = parser().parse_args([*command, *words])
        return calibrate(arguments, port, self.robot, self.bench(), self)

    def found(self) -> dict[str, float]:
        file = self.folder / CALIBRATION_FILE
        return {name: row.offset for name, row in read_calibration(file).items()}


@pytest.fixture
def make_arm(tmp_path: Path) -> Callable[[str], Arm]:
    return lambda name: Arm(Path(shutil.copytree(ROBOTS_DIR / name, tmp_path / name)))


@pytest.mark.parametrize(
    ("name", "joints"),
    [("so101", ("shoulder_pan", "gripper")), ("koch_v1_1", ("gripper",))],
)
def test_a_horn_that_sits_wrong_is_found_and_the_limits_come_back(make_arm, name, joints):
    arm = make_arm(name)
    words = [word for joint in joints for word in ("--joint", joint)]
    starts = {joint: arm.holds(joint, "present_position") for joint in joints}
    assert arm.calibrate(*words) == 0
    declared = {one.joint: one.offset for one in arm.robot.servo_bus.servos}
    register, full = FULL[name]
    for joint in joints:
        assert arm.found()[joint] == pytest.approx(declared[joint] - OFF_RAD, abs=0.004)
        assert arm.holds(joint, register) == full
        assert arm.holds(joint, "torque_enable") == 0
        assert arm.holds(joint, "present_position") == pytest.approx(starts[joint], abs=60)
        assert arm.holds(joint, "homing_offset") == 0


def test_physics_agrees_on_a_gripper_of_the_twin(tmp_path):
    folder = Path(shutil.copytree(ROBOTS_DIR / "so101", tmp_path / "so101"))
    arm = Arm(folder)
    twin = Twin(arm.robot)
    clock = SimClock(twin)
    twin.slip_encoder(6, OFF_RAD)
    clock.sleep_until(clock.now_ns() + NS_PER_S)
    arm.wire = Wire(MemoryLine(twin.servos, clock))
    arm.now_ns, arm.sleep_until = clock.now_ns, clock.sleep_until
    arm.calibrate("--joint", "gripper")
    assert arm.found() == {"gripper": pytest.approx(0.7854 - OFF_RAD, abs=0.004)}


@pytest.mark.parametrize(
    ("joint", "low_rad", "high_rad", "words"),
    [
        ("gripper", -0.9, 0.2, "something is in the way"),
        ("gripper", -0.9, 0.92, "something is in the way"),
        ("gripper", -0.9, 1.2, "a stop gives way, or is not there"),
        ("gripper", -0.9, 3.0, "no stop was met; is the MJCF's range right?"),
        ("wrist_roll", -9.0, 9.0, "takes goals from pulse 20 to 4075 only, and no stop was met"),
    ],
)
def test_what_are_not_the_stops_is_refused(make_arm, joint, low_rad, high_rad, words):
    """The gripper's travel is 1.92 rad, from -0.96 of its servo."""
    arm = make_arm("so101")
    arm.free.rotors.stops_rad[:, arm.row(joint)] = low_rad, high_rad
    with pytest.raises(CommandFailed, match=f"not calibrated: {joint}"):
        arm.calibrate("--joint", joint)
    assert words in arm.told[0]
    assert arm.found() == {}
    assert (arm.holds(joint, "torque_enable"), arm.holds(joint, "torque_limit")) == (0, 1000)


class ImpatientWire(Wire):
    """Send a signal with the 400th transaction, and with each of those that follow."""

    def write(self, data: bytes) -> None:
        self.ends_after -= 1
        if self.ends_after <= 0:
            signal.raise_signal(signal.SIGINT if self.ends_after % 2 else signal.SIGTERM)
        self.line.write(data)


@pytest.mark.parametrize("name", FULL)
def test_signals_end_with_the_servo_as_it_was_however_many_come(make_arm, name):
    arm = make_arm(name)
    arm.wire = ImpatientWire(arm.wire.line, ends_after=400)
    with pytest.raises(KeyboardInterrupt):
        arm.calibrate("--joint", "gripper")
    register, full = FULL[name]
    assert (arm.holds("gripper", "torque_enable"), arm.holds("gripper", register)) == (0, full)


def test_a_servo_that_held_goes_on_holding_with_its_own_limit(make_arm):
    arm = make_arm("so101")
    drive = arm.bench().drive(arm.bench().servo(6), 1.0)
    drive.hold()
    arm.wire.ends_after, arm.wire.ending, arm.wire.keeps_ending = 400, KeyboardInterrupt(), False
    with pytest.raises(KeyboardInterrupt):
        arm.calibrate("--joint", "gripper")
    assert (arm.holds("gripper", "torque_enable"), arm.holds("gripper", "torque_limit")) == (
        1,
        1000,
    )
    assert arm.holds("gripper", "goal_position") == arm.holds("gripper", "present_position")


def test_a_lost_bus_is_said_and_leaves_little_torque(make_arm):
    arm = make_arm("so101")
    arm.wire.ends_after = 400
    with pytest.raises(LinkLost):
        arm.calibrate("--joint", "gripper")
    assert "it may still press with 15% of its torque: cut the servos' supply" in arm.told[0]
    assert arm.holds("gripper", "torque_limit") == 150
    lead = arm.holds("gripper", "goal_position") - arm.holds("gripper", "present_position")
    assert abs(lead) <= 64


@pytest.mark.parametrize("joint", ["shoulder_lift", "elbow"])
def test_only_joints_of_the_robot_file_are_driven(make_arm, joint):
    arm = make_arm("so101")
    with pytest.raises(UsageError, match="allows it for shoulder_pan, wrist_roll, gripper"):
        arm.calibrate("--joint", joint)
