"""Calibrate emulated servos whose shafts the test turns, as a person does with the joints."""

import argparse
import json
import shutil
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from itertools import pairwise
from math import tau
from pathlib import Path

import pytest

from drivers.clock import NS_PER_S
from drivers.dynamixel.tables.control_table import PULSE_RAD
from drivers.dynamixel.tools.bench import DynamixelBench
from drivers.servo.errors import ServoSilent
from sim_twin.ports.lines import MemoryLine
from sim_twin.servos import EmulatedServoSpec
from sim_twin.servos.server import FreeServos
from vla_deploy.cli.devices.servo_bus import ServoBusPort
from vla_deploy.cli.devices.servo_calibrate import calibrate
from vla_deploy.cli.errors import CommandFailed, UsageError
from vla_deploy.cli.main import parser
from vla_deploy.robots import load_robot
from vla_deploy.robots.calibration.calibration import CALIBRATION_FILE, read_calibration
from vla_deploy.robots.loader import ROBOTS_DIR

LOWER, UPPER = "LOWER", "UPPER"
STEPS = 40


class Butler:
    """Be a limp robot on a bench: all its servos, the joints where the hand puts them.

    `mounted` tells how servos really sit, where that is not what the robot file says.
    """

    def __init__(self, folder: Path, mounted: Mapping[str, tuple[int, float]]) -> None:
        self.folder = folder
        self.robot = load_robot(folder)
        self.mounted = mounted
        self.servos = self.robot.servo_bus.servos
        self.bench = FreeServos(
            [EmulatedServoSpec(id=one.id, model_name=one.model) for one in self.servos]
        )
        self.bank = self.bench.bank
        self.rows = {one.joint: row for row, one in enumerate(self.servos)}
        self.time_ns = 10 * NS_PER_S
        self.drift: dict[str, float] = {}
        for one in self.servos:
            self.put(one.joint, self.robot.poses["rest"].get(one.joint, 0.0))
        self.sleep_until(self.time_ns + NS_PER_S // 10)
        self.line = MemoryLine(self.bank, self)

    def now_ns(self) -> int:
        return self.time_ns

    def sleep_until(self, deadline_ns: int) -> None:
        for joint, speed_rad_s in self.drift.items():
            seconds = (deadline_ns - self.time_ns) / NS_PER_S
            self.bench.rotors.position_rad[self.rows[joint]] += speed_rad_s * seconds
        self.time_ns = max(self.time_ns, deadline_ns)
        self.bench.advance_to(self.time_ns)

    def put(self, joint: str, value: float) -> None:
        servo = self.servos[self.rows[joint]]
        sign, offset = self.mounted.get(joint, (servo.sign, servo.offset))
        angle = (value - offset) / (sign * servo.travel_per_rad)
        self.bench.rotors.position_rad[self.rows[joint]] = angle

    def link(self) -> DynamixelBench:
        return DynamixelBench(self.line, self, self.robot.servo_bus.baud)


class Hand:
    """Do what the guide asks for, or what `habits` says instead, and note what is told."""

    def __init__(self, butler: Butler) -> None:
        self.butler = butler
        self.told: list[str] = []
        self.asked: list[str] = []
        self.habits: dict[str, Callable[[str, Callable[[], None]], None]] = {}

    def tell(self, text: str) -> None:
        self.told.append(text)

    def wait(self, text: str, meanwhile: Callable[[], None]) -> None:
        self.asked.append(text)
        joint = text.partition(":")[0]
        end = next((word for word in (LOWER, UPPER) if word in text), "mark")
        habit = self.habits.get(end, self.obey)
        habit(joint, meanwhile)
        self.pass_time(meanwhile)

    def obey(self, joint: str, meanwhile: Callable[[], None]) -> None:
        low, high = STOPS[joint]
        text = self.asked[-1]
        if LOWER in text:
            self.move(joint, low, meanwhile)
        elif UPPER in text:
            self.move(joint, high, meanwhile, start=low)
        else:
            self.move(joint, float(text.partition(" for ")[2].partition(",")[0]), meanwhile)

    def move(
        self, joint: str, end: float, meanwhile: Callable[[], None], start: float | None = None
    ) -> None:
        begin = end if start is None else start
        for step in range(1, STEPS + 1):
            self.butler.put(joint, begin + (end - begin) * step / STEPS)
            self.pass_time(meanwhile)

    def pass_time(self, meanwhile: Callable[[], None]) -> None:
        self.butler.sleep_until(self.butler.now_ns() + NS_PER_S // 50)
        meanwhile()


STOPS = {"left_elbow": (0.0, 2.6), "head_pan": (-1.6, 1.6), "left_wrist_roll": (-3.05, 3.05)}


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return Path(shutil.copytree(ROBOTS_DIR / "butler", tmp_path / "butler"))


@pytest.fixture
def make_butler(folder: Path) -> Callable[..., Butler]:
    def make(**mounted: tuple[int, float]) -> Butler:
        return Butler(folder, mounted)

    return make


def run(butler: Butler, hand: Hand, *words: str) -> int:
    arguments = parser().parse_args(["servo", "calibrate", "--robot", "butler", *words])
    wire = ServoBusPort(port=Path("bench"), baud=3_000_000, robot=butler.robot, clock=butler)
    return calibrate(arguments, wire, butler.robot, butler.link(), hand)


def calibrated(butler: Butler, joint: str) -> tuple[int, float]:
    servos = load_robot(butler.folder).servo_bus.servos
    servo = servos[butler.rows[joint]]
    return servo.sign, servo.offset


def test_several_joints_come_one_after_another_into_the_file_that_was_named(make_butler, tmp_path):
    butler = make_butler(left_elbow=(1, 1.2), head_pan=(1, 0.1))
    other = tmp_path / "mine.toml"
    words = ("--joint", "left_elbow", "--joint", "head_pan", "--output", str(other))
    run(butler, Hand(butler), *words)
    found = read_calibration(other)
    assert found["left_elbow"].offset == pytest.approx(1.2, abs=0.004)
    assert found["head_pan"].offset == pytest.approx(0.1, abs=0.004)
    assert found["left_elbow"].servo_id == 3
    assert not (butler.folder / CALIBRATION_FILE).exists()


@pytest.mark.parametrize("offset", [1.1, 1.3, 1.55])
def test_a_joint_moved_from_end_to_end_gets_its_true_offset(make_butler, offset):
    butler = make_butler(left_elbow=(1, offset))
    hand = Hand(butler)
    assert run(butler, hand, "--joint", "left_elbow") == 0
    sign, found = calibrated(butler, "left_elbow")
    assert sign == 1
    assert found == pytest.approx(offset, abs=2 * PULSE_RAD)
    assert hand.asked == [
        "left_elbow: move it to its LOWER end (0), hold it",
        "left_elbow: move it to its UPPER end (2.6), hold it",
    ]
    assert f"left_elbow: sign +1, offset 1.3000 -> {found:.4f} ({found - 1.3:+.4f})" in hand.told


def test_a_count_that_starts_over_during_the_sweep_changes_nothing(make_butler):
    """A servo that restarts comes back within 0..4095, whatever turn it counted before."""
    butler = make_butler(left_wrist_roll=(1, 0.05))
    hand = Hand(butler)
    positions: list[int] = []

    def sweep_over_a_turn(joint: str, meanwhile: Callable[[], None]) -> None:
        # the person comes in from a turn further, as a wire wound up allows
        hand.move(joint, -3.05 + tau, meanwhile)

    def back_with_a_restart(joint: str, meanwhile: Callable[[], None]) -> None:
        start = -3.05 + tau
        for step in range(1, STEPS + 1):
            butler.put(joint, start + 6.1 * step / STEPS)
            hand.pass_time(meanwhile)
            positions.append(butler.bank.register(6, "present_position"))
            if step == STEPS // 2:
                link = butler.link()
                link.reboot(link.servo(6))

    hand.habits = {LOWER: sweep_over_a_turn, UPPER: back_with_a_restart}
    run(butler, hand, "--joint", "left_wrist_roll")
    jumps = [abs(b - a) for a, b in pairwise(positions)]
    assert max(jumps) > 3000, "the count did start over"
    assert calibrated(butler, "left_wrist_roll")[1] == pytest.approx(0.05, abs=0.004)


def test_a_servo_that_was_turned_beyond_its_turn_is_to_be_restarted(make_butler):
    butler = make_butler(head_pan=(1, 0.0))
    hand = Hand(butler)
    low, high = STOPS["head_pan"]
    hand.habits = {
        LOWER: lambda joint, m: hand.move(joint, low + tau, m),
        UPPER: lambda joint, m: hand.move(joint, high + tau, m, start=low + tau),
    }
    run(butler, hand, "--joint", "head_pan")
    assert calibrated(butler, "head_pan")[1] == pytest.approx(0.0, abs=0.004)
    assert hand.told[-1].endswith("restart it before the robot runs: vla-deploy servo reboot 21")


def test_a_marked_pose_gives_the_offset_and_keeps_the_sign(make_butler):
    butler = make_butler(left_elbow=(1, 1.42))
    hand = Hand(butler)
    run(butler, hand, "--joint", "left_elbow", "--method", "mark", "--at", "1.0")
    assert hand.asked == ["left_elbow: move it to its mark for 1, hold it"]
    assert calibrated(butler, "left_elbow")[1] == pytest.approx(1.42, abs=0.002)


def test_a_known_pose_calibrates_all_its_joints_at_once_without_a_question(make_butler, capsys):
    butler = make_butler(left_elbow=(1, 1.25), left_gripper=(1, 0.0225), right_elbow=(-1, 1.4))
    for joint, value in butler.robot.poses["rest"].items():
        butler.put(joint, value)
    butler.sleep_until(butler.now_ns() + NS_PER_S // 10)
    hand = Hand(butler)
    run(butler, hand, "--from-pose", "rest", "--json")
    assert hand.asked == []
    document = json.loads(capsys.readouterr().out)
    assert len(document["joints"]) == 16
    assert document["failed"] == []
    after = {row["joint"]: row for row in document["joints"]}
    assert after["left_elbow"]["offset"] == pytest.approx(1.25, abs=0.002)
    assert after["left_elbow"]["offset_before"] == 1.3
    assert after["left_gripper"]["offset"] == pytest.approx(0.0225, abs=3e-5)
    assert calibrated(butler, "right_elbow") == (-1, pytest.approx(1.4, abs=0.002))


def test_values_in_the_command_line_name_their_joints(make_butler):
    butler = make_butler(head_pan=(1, -0.2))
    butler.put("head_pan", 0.3)
    butler.sleep_until(butler.now_ns() + NS_PER_S // 10)
    run(butler, Hand(butler), "--from-pose", "head_pan=0.3")
    assert list(read_calibration(butler.folder / CALIBRATION_FILE)) == ["head_pan"]
    assert calibrated(butler, "head_pan")[1] == pytest.approx(-0.2, abs=0.002)


def refuses(butler: Butler, hand: Hand, words: str, *arguments: str) -> None:
    """Expect three refusals and nothing written."""
    with pytest.raises(CommandFailed, match="not calibrated: left_elbow; see above"):
        run(butler, hand, "--joint", "left_elbow", *arguments)
    refusals = [text for text in hand.told if text.startswith("refused: ")]
    assert len(refusals) == 3
    assert all(words in text for text in refusals), refusals
    assert not (butler.folder / CALIBRATION_FILE).exists()


Habit = Callable[[Hand, str, Callable[[], None]], None]


def moves(*ways: tuple[str, float, float]) -> Habit:
    """Move joints one after the other, each from a start to an end."""

    def habit(hand: Hand, joint: str, meanwhile: Callable[[], None]) -> None:
        for name, start, end in ways:
            hand.move(name, end, meanwhile, start=start)

    return habit


def lets_go(hand: Hand, joint: str, meanwhile: Callable[[], None]) -> None:
    hand.obey(joint, meanwhile)
    hand.butler.drift = {joint: 0.1}


ELBOW_UP, ELBOW_DOWN = moves(("left_elbow", 2.6, 2.6)), moves(("left_elbow", 2.6, 0.0))
HEAD, ELBOW = ("head_pan", -1.5, 1.5), ("left_elbow", 0.0, 2.6)
FIT = "it moved by {} degrees, its range 0..2.6 is 149.0 degrees"


@pytest.mark.parametrize(
    ("habits", "words"),
    [
        ({UPPER: moves()}, "left_elbow: it did not move; move left_elbow from end to end"),
        ({UPPER: moves(HEAD)}, "it did not move; head_pan moved instead"),
        (
            {UPPER: moves(HEAD, ELBOW)},
            "head_pan moved too; hold the others and move left_elbow alone",
        ),
        ({UPPER: moves(("left_elbow", 0.0, 1.0))}, FIT.format("57.2")),
        ({UPPER: moves(("left_elbow", 0.0, 4.5))}, FIT.format("257.8")),
        (
            {LOWER: ELBOW_UP, UPPER: ELBOW_DOWN},
            "it went against its declared sign 1: begin at the lower end (0)",
        ),
        ({LOWER: lets_go}, "while it was measured; hold it still"),
        ({"mark": lets_go}, "while it was measured; hold it still"),
    ],
)
def test_a_joint_that_is_moved_in_another_way_than_asked_is_refused(make_butler, habits, words):
    butler = make_butler()
    hand = Hand(butler)
    hand.habits = {end: partial(habit, hand) for end, habit in habits.items()}
    refuses(butler, hand, words, "--method", "mark" if "mark" in habits else "ends")


def test_a_horn_mounted_across_the_end_of_the_turn_is_refused(make_butler):
    butler = make_butler(left_elbow=(1, 1.3 - 2.5))
    refuses(butler, Hand(butler), "left_elbow: its travel crosses the end of the servo's turn")


def test_a_servo_mounted_the_other_way_round_is_taken_when_asked_for(make_butler):
    butler = make_butler(left_elbow=(-1, 1.35))
    refuses(butler, Hand(butler), "it went against its declared sign 1")
    run(butler, Hand(butler), "--joint", "left_elbow", "--accept-sign")
    assert calibrated(butler, "left_elbow") == (-1, pytest.approx(1.35, abs=0.004))


def test_a_refusal_is_followed_by_another_try(make_butler):
    butler = make_butler(left_elbow=(1, 1.22))
    hand = Hand(butler)
    tries = iter([moves(), Hand.obey])
    hand.habits = {UPPER: lambda joint, meanwhile: next(tries)(hand, joint, meanwhile)}
    assert run(butler, hand, "--joint", "left_elbow") == 0
    assert calibrated(butler, "left_elbow")[1] == pytest.approx(1.22, abs=0.004)


def test_a_refusal_loses_no_earlier_result(make_butler):
    butler = make_butler(left_elbow=(1, 1.2))
    run(butler, Hand(butler), "--joint", "left_elbow")
    hand = Hand(butler)
    hand.habits = {UPPER: lambda joint, meanwhile: None}
    with pytest.raises(CommandFailed, match="not calibrated: head_pan"):
        run(butler, hand, "--joint", "head_pan")
    assert list(read_calibration(butler.folder / CALIBRATION_FILE)) == ["left_elbow"]


def test_a_bus_that_is_lost_half_way_keeps_what_was_measured(make_butler):
    butler = make_butler(left_elbow=(1, 1.2))
    hand = Hand(butler)

    def unplug(joint: str, meanwhile: Callable[[], None]) -> None:
        if joint == "head_pan":
            butler.line.unplug()

    hand.habits = {LOWER: lambda j, m: (hand.obey(j, m), unplug(j, m))}
    with pytest.raises(Exception, match="unplugged"):
        run(butler, hand, "--joint", "left_elbow", "--joint", "head_pan")
    assert list(read_calibration(butler.folder / CALIBRATION_FILE)) == ["left_elbow"]


def test_torque_goes_off_only_with_consent(make_butler):
    butler = make_butler()
    link = butler.link()
    link.write(link.servo(3), "torque_enable", 1)
    with pytest.raises(UsageError, match="The torque of left_elbow goes off"):
        run(butler, Hand(butler), "--joint", "left_elbow")
    assert butler.bank.register(3, "torque_enable") == 1
    run(butler, Hand(butler), "--joint", "left_elbow", "--yes")
    assert butler.bank.register(3, "torque_enable") == 0


def test_a_silent_servo_is_an_error_only_if_it_is_to_be_calibrated(make_butler):
    butler = make_butler(left_elbow=(1, 1.2))
    butler.bank.silence(21)
    run(butler, Hand(butler), "--joint", "left_elbow")
    with pytest.raises(ServoSilent, match="ping servo 21"):
        run(butler, Hand(butler), "--joint", "head_pan")


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        (["--joint", "tail"], "butler has no servo joint tail; it has left_shoulder_yaw"),
        (["--from-pose", "lotus"], "--from-pose lotus: expected joint=value,... or a pose"),
        (["--from-pose", "head_pan=9"], "head_pan: 9 is outside of its range -1.6..1.6"),
        (["--from-pose", "tail=0"], "butler has no servo joint tail"),
        (["--from-pose", "head_pan=0", "--joint", "left_elbow"], "no value for left_elbow"),
        (["--method", "mark", "--at", "2", "--joint", "head_pan"], "head_pan: 2 is outside"),
    ],
)
def test_a_request_that_makes_no_sense_is_refused_before_anything_is_done(
    make_butler, words, complaint
):
    butler = make_butler()
    hand = Hand(butler)
    with pytest.raises(UsageError) as caught:
        run(butler, hand, *words)
    assert complaint in str(caught.value)
    assert hand.asked == []


def test_a_servo_that_measures_no_whole_turn_is_refused(make_butler):
    butler = make_butler()
    bus = butler.robot.servo_bus
    short = [replace(one, model="SCS0009") for one in bus.servos]
    butler.robot = replace(butler.robot, servo_bus=replace(bus, servos=tuple(short)))
    hand = Hand(butler)
    with pytest.raises(UsageError, match=r"head_pan, SCS0009\) does not measure a whole turn"):
        run(butler, hand, "--joint", "head_pan")
    assert hand.asked == []


def test_a_port_without_a_robot_is_refused(capsys):
    arguments = parser().parse_args(["servo", "calibrate", "--port", "/dev/ttyUSB0"])
    assert isinstance(arguments, argparse.Namespace)
    with pytest.raises(UsageError, match="add --robot"):
        arguments.run(arguments)
