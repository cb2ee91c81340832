"""Keys and sticks move joints and the hand as long as their dead-man control is held."""

import os
from collections.abc import Iterator

import numpy as np
import pytest

from drivers.clock import NS_PER_S
from drivers.errors import LinkLost
from drivers.estop.input_event import EventType, InputEvent, encode_event
from drivers.gamepad import ABSOLUTE, Gamepad, PadAxis, PadButton
from tests.vla_deploy.teleoperation.conftest import SO101, HandClock
from vla_deploy.robots.kinematics.model import RobotModel
from vla_deploy.teleoperation.driving import DriveWish
from vla_deploy.teleoperation.errors import HandMotionEnded
from vla_deploy.teleoperation.jogging import HAND_SPEED_M_S, LEAD_RAD, JogHand, JogWish
from vla_deploy.teleoperation.keyboard import Keyboard, key_table
from vla_deploy.teleoperation.pad_jog import PadDrive, PadJog

READY = np.array(list(SO101.poses["ready"].values()))
NOTHING = JogWish()


class Wishes:
    """Be a control that asks for `now`."""

    def __init__(self) -> None:
        self.now = NOTHING

    def wish(self) -> JogWish:
        return self.now


class Jogged:
    """A pose that moves from `setpoints`, which follow it unless they are held."""

    def __init__(self) -> None:
        self.clock = HandClock()
        self.wishes = Wishes()
        self.setpoints = READY.copy()
        self.hand = JogHand(SO101, self.clock, self.wishes, lambda: self.setpoints)
        self.hand.read()

    def pass_time(self, seconds: float, *, held: bool = False) -> np.ndarray:
        for _ in range(round(seconds / 0.02)):
            self.clock.time_ns += 20_000_000
            pose = self.hand.read()
            assert pose is not None
            if not held:
                self.setpoints = pose.position.copy()
        return pose.position


def test_a_joint_moves_at_a_quarter_of_its_speed_until_it_is_let_go_or_at_its_limit() -> None:
    jogged = Jogged()
    jogged.wishes.now = JogWish(joints={"shoulder_pan": 1.0})
    assert jogged.pass_time(1.0)[0] - READY[0] == pytest.approx(0.5, abs=0.001)
    jogged.wishes.now = NOTHING
    stood = jogged.pass_time(0.02)
    assert 0.51 < stood[0] - READY[0] < 0.56, "where it can stop, not where it was let go"
    assert jogged.pass_time(1.0) == pytest.approx(stood, abs=1e-9)
    jogged.wishes.now = JogWish(joints={"shoulder_pan": 1.0})
    assert jogged.pass_time(6.0)[0] == SO101.limits["shoulder_pan"].max


def test_the_pose_does_not_run_away_from_joints_that_cannot_follow() -> None:
    jogged = Jogged()
    jogged.wishes.now = JogWish(joints={"elbow_flex": -1.0})
    assert jogged.pass_time(2.0, held=True)[2] == pytest.approx(READY[2] - LEAD_RAD)


@pytest.mark.parametrize("axis", range(3))
def test_the_hand_goes_straight(axis: int) -> None:
    jogged, model = Jogged(), RobotModel(SO101)
    wanted = np.zeros(3)
    wanted[axis] = 1.0
    jogged.wishes.now = JogWish(hand=(wanted[0], wanted[1], wanted[2]))
    before = model.site_pose("grip", READY)[:3, 3]
    moved = model.site_pose("grip", jogged.pass_time(0.3))[:3, 3] - before
    assert moved[axis] > 0.4 * 0.3 * HAND_SPEED_M_S
    assert np.linalg.norm(moved - moved[axis] * wanted) < 0.4 * moved[axis]


@pytest.fixture
def pipe() -> Iterator[tuple[int, int]]:
    ends = os.pipe()
    yield ends
    for one in ends:
        os.close(one)


def test_a_key_counts_for_a_moment(pipe: tuple[int, int]) -> None:
    clock = HandClock()
    keyboard = Keyboard(pipe[0], clock, key_table(SO101.joint_names), NOTHING)
    assert keyboard.wish() == NOTHING
    for keys, wish in (
        (b"1", JogWish(joints={"shoulder_pan": 1.0})),
        (b"1y", JogWish(joints={"gripper": -1.0})),
        (b"\x1b[A", JogWish(hand=(1.0, 0.0, 0.0))),
        (b"\x1b[5~", JogWish(hand=(0.0, 0.0, 1.0))),
        (b"1 ", NOTHING),
    ):
        os.write(pipe[1], keys)
        assert keyboard.wish() == wish
        clock.time_ns += round(0.29 * NS_PER_S)
        assert keyboard.wish() == wish
        clock.time_ns += round(0.02 * NS_PER_S)
        assert keyboard.wish() == NOTHING


class PadLine:
    """Be an input device whose events a test writes."""

    def __init__(self) -> None:
        self.pending = b""
        self.is_gone = False

    def put(self, kind: int, code: int, value: int) -> None:
        self.pending += encode_event(InputEvent(time_us=0, type=kind, code=code, value=value))

    def write(self, data: bytes) -> None:
        raise NotImplementedError

    def read(self, max_bytes: int, deadline_ns: int) -> bytes:
        if self.is_gone:
            raise LinkLost("unplugged")
        data, self.pending = self.pending[:max_bytes], self.pending[max_bytes:]
        return data

    def discard_input(self) -> None:
        self.pending = b""

    def close(self) -> None:
        self.is_gone = True


def test_sticks_count_while_the_left_shoulder_is_held() -> None:
    line = PadLine()
    pad = Gamepad(line, lambda axis: (0, 255) if axis == PadAxis.RIGHT_TRIGGER else (-100, 100))
    jog = PadJog(pad, SO101.joint_names, SO101.gripper_joints)
    line.put(ABSOLUTE, PadAxis.LEFT_Y, -100)
    line.put(ABSOLUTE, PadAxis.LEFT_X, 10)  # within the dead zone
    line.put(ABSOLUTE, PadAxis.RIGHT_TRIGGER, 255)
    assert jog.wish() == NOTHING
    line.put(EventType.KEY, PadButton.LEFT_SHOULDER, 1)
    assert jog.wish() == JogWish(joints={"gripper": -1.0, "shoulder_lift": 1.0})
    line.put(EventType.KEY, PadButton.RIGHT_SHOULDER, 1)
    assert jog.wish().hand == (1.0, 0.0, 0.0)
    line.put(ABSOLUTE, PadAxis.RIGHT_X, 100)
    assert PadDrive(pad).wish() == DriveWish(ahead=1.0, turn=-1.0)
    line.put(EventType.KEY, PadButton.LEFT_SHOULDER, 0)
    assert jog.wish() == NOTHING
    assert PadDrive(pad).wish() == DriveWish()
    line.is_gone = True
    with pytest.raises(HandMotionEnded, match="the gamepad is lost: unplugged"):
        jog.wish()
