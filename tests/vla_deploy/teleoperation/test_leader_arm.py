"""A leader is read, never written to; what is no credible pose is not followed."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from drivers.clock import NS_PER_S
from drivers.servo.family import family_of, servo_family
from drivers.servo.tools.bench import ServoBench
from sim_twin.ports.lines import MemoryLine
from sim_twin.servos.server import FreeRobotServos, FreeServos, make_specs
from tests.vla_deploy.teleoperation.conftest import FOLDED, MOTORS, SO101, EmulatedLeader, HandClock
from vla_deploy.robots import load_robot
from vla_deploy.robots.calibration.lerobot_file import LeRobotMotor
from vla_deploy.robots.calibration.lerobot_units import units_of
from vla_deploy.teleoperation.errors import HandMotionEnded, LeaderUnusable
from vla_deploy.teleoperation.leader_arm import LeaderArm, open_leader
from vla_deploy.teleoperation.leader_calibration import calibrated_leader
from vla_deploy.teleoperation.leader_robot import open_leader_robot


@pytest.fixture
def clock() -> HandClock:
    return HandClock()


@pytest.fixture
def leader(clock: HandClock) -> EmulatedLeader:
    made = EmulatedLeader(clock)
    pass_time(made, clock)
    return made


def pass_time(leader: EmulatedLeader, clock: HandClock, seconds: float = 0.02) -> None:
    clock.sleep_until(clock.now_ns() + round(seconds * NS_PER_S))
    leader.turn()


def opened(
    leader: EmulatedLeader, clock: HandClock, motors: dict[str, LeRobotMotor] = MOTORS
) -> LeaderArm:
    return open_leader(leader.bench(), clock, SO101, motors, "feetech")


def test_it_gives_the_joints_of_the_robot_and_their_speed(
    leader: EmulatedLeader, clock: HandClock
) -> None:
    arm = opened(leader, clock)
    speed = np.array([0.5, 0.2, -0.3, 0.1, 0.8, 0.4])
    leader.pose = lambda at_s: FOLDED + speed * at_s
    for _ in range(6):
        pass_time(leader, clock)
        pose = arm.read()
    assert pose is not None
    np.testing.assert_allclose(pose.position, leader.pose(0.14), atol=0.004)
    np.testing.assert_allclose(pose.velocity, speed, atol=0.06)


def test_the_homing_offset_of_the_file_counts_whatever_the_servos_hold(
    leader: EmulatedLeader, clock: HandClock
) -> None:
    shifted = {name: replace(motor, homing_offset=-1000) for name, motor in MOTORS.items()}
    shifted = {
        name: replace(motor, range_min=motor.range_min + 800, range_max=motor.range_max + 800)
        for name, motor in shifted.items()
    }
    pose = opened(leader, clock, shifted).read()
    assert pose is not None
    apart = 200 * 2 * np.pi / 4096
    np.testing.assert_allclose(pose.position[:5], FOLDED[:5] + apart, atol=0.003)


def test_a_dynamixel_leader_is_read_by_the_same_contract(clock: HandClock) -> None:
    robot = load_robot("koch_v1_1")
    servos = FreeServos(make_specs(6, ["XL330-M288"]))
    servos.rotors.position_rad[:] = 0.3
    servos.advance_to(clock.now_ns())
    motors = {
        name: LeRobotMotor(
            id=row + 1, drive_mode=0, homing_offset=0, range_min=1024, range_max=3072
        )
        for row, name in enumerate(robot.joint_names)
    }
    bench = servo_family("dynamixel").bench(MemoryLine(servos.bank, clock), clock, 1_000_000)
    arm = open_leader(bench, clock, robot, motors, "dynamixel")
    pose = arm.read()
    assert pose is not None
    middles = units_of(robot).to_joints(np.zeros(6))
    turned = np.abs(pose.position - middles)[:5]
    np.testing.assert_allclose(turned, 0.3, atol=0.002)
    servos.bank.silence(2)
    clock.time_ns += NS_PER_S
    with pytest.raises(HandMotionEnded, match=r"servo 2 .* gave no position"):
        arm.read()


def unplug(leader: EmulatedLeader) -> None:
    leader.line.unplug()


def silence(leader: EmulatedLeader) -> None:
    leader.servos.bank.silence(3)


def jump(leader: EmulatedLeader) -> None:
    leader.pose = lambda _: FOLDED + np.array([0, 0, 0, 0, 0.9, 0])


@pytest.mark.parametrize(
    ("act", "words", "within_s"),
    [
        (unplug, "the leader is lost: .*unplugged", 0.03),
        (silence, r"lost: servo 3 \(elbow_flex, .*\) gave no position for 0.15 s", 0.2),
        (jump, r"lost: servo 5 \(wrist_roll, .*\) jumped by 0.90 rad between two reads", 0.2),
    ],
)
def test_one_that_is_lost_ends_in_bounded_time(
    leader: EmulatedLeader,
    clock: HandClock,
    act: Callable[[EmulatedLeader], None],
    words: str,
    within_s: float,
) -> None:
    arm = opened(leader, clock)
    assert arm.read() is not None
    began_ns = clock.now_ns()
    act(leader)
    with pytest.raises(HandMotionEnded, match=words):
        for _ in range(20):
            pass_time(leader, clock)
            assert arm.read() is None
    assert clock.now_ns() - began_ns <= within_s * NS_PER_S


def test_a_servo_that_misses_one_read_is_no_loss(leader: EmulatedLeader, clock: HandClock) -> None:
    arm = opened(leader, clock)
    assert arm.read() is not None
    for silent in (True, False):
        leader.servos.bank.silence(3, silent=silent)
        pass_time(leader, clock)
        assert (arm.read() is None) == silent
    assert arm.missed == 1


def test_torque_or_a_calibration_of_another_arm_is_refused(
    leader: EmulatedLeader, clock: HandClock
) -> None:
    with pytest.raises(LeaderUnusable, match="calibration has jaw; so101 has shoulder_pan"):
        opened(leader, clock, {"jaw": MOTORS["gripper"]})
    bench = leader.bench()
    bench.link.write(bench.servo(2), "torque_enable", 1)  # type: ignore[attr-defined]
    with pytest.raises(LeaderUnusable, match="shoulder_lift: torque is on"):
        opened(leader, clock)


class Hands:
    """Move the leader as the calibration asks for it."""

    def __init__(self, leader: EmulatedLeader, clock: HandClock, *, sweeps: bool = True) -> None:
        self._leader, self._clock, self._sweeps = leader, clock, sweeps

    def tell(self, text: str) -> None:
        raise AssertionError(text)

    def wait(self, text: str, meanwhile: Callable[[], None]) -> None:
        middle = np.array([0, 0, 0, 0, 0, 0.7854])
        ends = np.array([1.8, 1.7, 1.6, 1.6, 2.7, 0.9])
        self._leader.pose = lambda _: middle
        if "stop to stop" in text and self._sweeps:
            self._leader.pose = lambda at_s: middle + ends * np.sin(10 * at_s)
        for _ in range(40):
            pass_time(self._leader, self._clock)
            meanwhile()


def test_a_leader_is_calibrated_by_hand_and_follows_then(
    leader: EmulatedLeader, clock: HandClock
) -> None:
    with pytest.raises(LeaderUnusable, match="not moved from stop to stop: shoulder_pan by 0"):
        calibrated_leader(leader.bench(), SO101, "feetech", Hands(leader, clock, sweeps=False))
    motors = calibrated_leader(leader.bench(), SO101, "feetech", Hands(leader, clock))
    assert abs(motors["gripper"].homing_offset) == 400, "its middle lies there"
    leader.pose = lambda _: FOLDED
    pass_time(leader, clock)
    pose = opened(leader, clock, motors).read()
    assert pose is not None
    np.testing.assert_allclose(pose.position[:5], FOLDED[:5], atol=0.05)


@pytest.mark.parametrize("name", ["so101_leader", "koch_v1_1_leader"])
def test_a_leader_with_a_robot_file_is_read_by_it(name: str, clock: HandClock) -> None:
    robot = load_robot(name)
    follower = load_robot(name.removesuffix("_leader"))
    free = FreeRobotServos(robot)
    signs = np.array([one.sign for one in robot.servo_bus.servos])
    offsets = np.array([one.offset for one in robot.servo_bus.servos])
    wanted = np.array([0.3, -0.2, 0.4, 0.5, -0.6, 0.25])
    free.rotors.position_rad[:] = (wanted - offsets) / signs
    free.advance_to(clock.now_ns())
    family = family_of(robot.servo_bus.servos[0].model)
    line = MemoryLine(free.bank, clock)
    bench = family.bench(line, clock, 1_000_000)
    pose = open_leader_robot(bench, clock, follower, robot).read()
    assert pose is not None
    np.testing.assert_allclose(pose.position[:5], wanted[:5], atol=0.002)
    opens = follower.limits["gripper"]
    share = (pose.position[5] - opens.min) / (opens.max - opens.min)
    assert share == pytest.approx(0.25, abs=0.002)
    with pytest.raises(LeaderUnusable, match="it is X"):
        open_leader_robot(*other_arm(clock), follower, robot)


def other_arm(clock: HandClock) -> tuple[ServoBench, HandClock]:
    servos = FreeServos(make_specs(6, ["XL430-W250"]))
    servos.advance_to(clock.now_ns())
    line = MemoryLine(servos.bank, clock)
    return servo_family("dynamixel").bench(line, clock, 1_000_000), clock
