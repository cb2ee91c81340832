"""A relay in the servos' supply is fed while supervisor and control are live, and falls without."""

import shutil
import socket
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path

import pytest

from drivers.clock import NS_PER_S
from platforms import load_profile
from sim_twin.harness.lockstep import Lockstep
from vla_deploy.control.node import ControlNode
from vla_deploy.ipc import SharedSpace, topics
from vla_deploy.ipc.payloads.motion import OperatorActName
from vla_deploy.robots import RobotFileError, load_robot
from vla_deploy.robots.devices import PowerRelayDescription
from vla_deploy.robots.loader import ROBOT_FILE, ROBOTS_DIR
from vla_deploy.robots.servos.guard import unguarded_servos
from vla_deploy.supervisor.power_relay import PowerRelayFeed, RelayInputs, RelayRule
from vla_deploy.supervisor.processes.lifecycle import ProcessState

HOLD_S = 0.5
PERIOD_S = 0.05
PULSED = f'model = "GPIO"\nnumber = 27\nhold_s = {HOLD_S}\ncontrol_silence_s = 2.0\n'
TOLD = 'model = "LCUS-1"\nnumber = 1\ncontrol_silence_s = 2.0\n'
READY, STARTING, STOPPED = ProcessState.READY, ProcessState.STARTING, ProcessState.STOPPED
ESTOP, RESET, STOPPING = "estop", "reset", "stopping"


def robot_with(folder: Path, relay: str, category: int = 2) -> Path:
    shutil.copytree(ROBOTS_DIR / "so101", folder)
    file = folder / ROBOT_FILE
    text = file.read_text(encoding="utf-8")
    text = text.replace("stop_category = 2", f"stop_category = {category}")
    table = f'[power_relay]\ndevice = "relay"\npath = "/dev/gpiochip0"\n{relay}\n'
    file.write_text(text.replace("[servo_bus]", f"{table}\n[servo_bus]", 1), encoding="utf-8")
    return folder


@pytest.mark.parametrize(
    ("steps", "cut_by_estop"),
    [
        pytest.param(
            [(0, None, STARTING, "", True), (9, None, STARTING, "", True)], True, id="start"
        ),
        pytest.param([(0, 0.1, READY, "", True), (1, 1.9, READY, "", True)], True, id="live"),
        pytest.param(
            [
                (0, 0.1, READY, "", True),
                (3, 2.1, READY, "", False),
                (4, 3.1, STARTING, "", False),  # the relay may not have fallen yet
                (5, 4.1, STARTING, "", True),
                (6, 0.0, READY, "", True),
            ],
            True,
            id="control is gone",
        ),
        pytest.param(
            [
                (0, 0.0, READY, "", True),
                (1, 0.0, READY, ESTOP, False),
                (2, 0.0, READY, ESTOP, False),
                (3, 0.0, READY, ESTOP + RESET, True),
                (4, 0.0, READY, ESTOP, True),  # the first reset found no servo yet
                (5, 0.0, READY, "", True),
                (6, 0.0, READY, ESTOP, False),
            ],
            True,
            id="emergency stop",
        ),
        pytest.param(
            [(0, 0.0, READY, "", True), (1, 0.0, READY, ESTOP, True)], False, id="category 2"
        ),
        pytest.param(
            [(0, 0.0, READY, ESTOP, True), (1, 0.0, READY, ESTOP, True)], True, id="latched before"
        ),
        pytest.param(
            [(0, 9.0, READY, STOPPING, True), (1, 10.0, STOPPED, STOPPING, False)],
            True,
            id="an orderly end",
        ),
    ],
)
def test_it_is_fed_while_both_are_live(
    steps: list[tuple[float, float | None, ProcessState, str, bool]], cut_by_estop: bool
) -> None:
    relay = PowerRelayDescription(
        device="relay", path="x", model="GPIO", number=1, hold_s=HOLD_S, control_silence_s=2.0
    )
    rule = RelayRule(relay, cut_by_estop=cut_by_estop)
    for at_s, age_s, control, words, fed in steps:
        seen = RelayInputs(
            now_ns=round(at_s * NS_PER_S),
            control_age_s=age_s,
            control=control,
            stopping=STOPPING in words,
            estop_latched=ESTOP in words,
            reset_asked=RESET in words,
        )
        assert rule.feeds(seen) is fed, at_s


class Supervising:
    """Step the feed as the supervisor does, as a node that can be killed."""

    period_s = PERIOD_S

    def __init__(self, feed: PowerRelayFeed) -> None:
        self._feed = feed

    def start(self) -> None:
        self._feed.step(READY, stopping=False)

    def step(self) -> None:
        self._feed.step(READY, stopping=False)

    def stop(self) -> None:
        self._feed.close()


class FedArm:
    """An SO-101 whose servos have a relay in their supply, with control and what feeds it."""

    def __init__(self, folder: Path, run_dir: Path) -> None:
        step = self.lockstep = Lockstep(str(folder), tmp_path=run_dir)
        self.space = SharedSpace(run_dir / "ipc", step.clock)
        self.feed = Supervising(PowerRelayFeed(step.robot, step.devices, self.space, step.clock))
        self.control = ControlNode(step.context, step.robot, load_profile("desktop"), step.devices)
        self._acts = self.space.ring_writer(topics.OPERATOR)
        self._status = self.space.cell_reader(topics.CONTROL_STATUS)
        step.add(self.feed)
        step.run_for(1.0)
        step.add(self.control)
        self.operate("arm")

    def operate(self, act: OperatorActName) -> None:
        self._acts.publish({"act": act, "source": "test", "reason": ""})
        self.lockstep.run_for(0.5)

    @property
    def torque(self) -> list[int]:
        bank = self.lockstep.twin.servos
        return [bank.register(one, "torque_enable") for one in range(1, 7)]

    @property
    def state(self) -> str:
        sample = self._status.latest()
        assert sample is not None
        return sample.document()["state"]

    def loses_supply_within(self, seconds: float) -> float | None:
        """Return after how much of the twin's time the servos have no supply, None: they have."""
        begin_s = self.lockstep.now_s
        if self.lockstep.run_until(lambda: not self.lockstep.twin.has_servo_supply, seconds):
            self.lockstep.run_for(0.05)
            return self.lockstep.now_s - begin_s
        return None


@pytest.fixture
def make_arm(tmp_path: Path) -> Iterator[Callable[..., FedArm]]:
    made: list[FedArm] = []

    def make(relay: str, category: int = 2) -> FedArm:
        made.append(FedArm(robot_with(tmp_path / "arm", relay, category), tmp_path))
        assert made[-1].state == "armed"
        assert made[-1].torque == [1] * 6
        return made[-1]

    yield make
    for one in made:
        one.lockstep.close()
        one.space.close()


def test_the_servos_lose_their_supply_when_the_supervisor_is_killed(make_arm) -> None:
    arm = make_arm(PULSED)
    arm.lockstep.kill(arm.feed)
    after_s = arm.loses_supply_within(HOLD_S + 2 * PERIOD_S)
    assert after_s is not None
    assert arm.torque == [0] * 6


def test_a_control_that_is_gone_for_too_long_ends_the_pulses(make_arm) -> None:
    arm = make_arm(PULSED)
    arm.lockstep.kill(arm.control)
    assert arm.loses_supply_within(1.5) is None, "a control that starts again finds arms that hold"
    assert arm.loses_supply_within(0.5 + HOLD_S + 0.2) is not None
    assert arm.torque == [0] * 6


@pytest.mark.parametrize(("category", "falls"), [(0, True), (2, False)])
def test_an_emergency_stop_opens_it_where_all_groups_lose_their_power(
    make_arm, category, falls
) -> None:
    arm = make_arm(PULSED, category)
    arm.operate("estop")
    assert (arm.loses_supply_within(HOLD_S + 0.2) is not None) is falls
    if not falls:
        return
    arm.lockstep.run_for(1.0)
    for act in ("reset", "reset", "arm"):  # the first one finds servos without supply
        arm.operate(act)
        arm.lockstep.run_for(1.0)
    assert arm.state == "armed"
    assert arm.lockstep.twin.has_servo_supply


def test_a_relay_that_is_told_stays_closed_and_check_says_so(make_arm) -> None:
    arm = make_arm(TOLD)
    arm.lockstep.kill(arm.feed)
    assert arm.loses_supply_within(3 * HOLD_S) is None
    assert "(LCUS-1) does not open by itself" in unguarded_servos(arm.lockstep.robot)


def test_an_orderly_end_opens_either(make_arm) -> None:
    arm = make_arm(TOLD)
    arm.lockstep.remove(arm.feed)
    assert arm.loses_supply_within(0.1) is not None


@pytest.mark.parametrize(
    ("relay", "words"),
    [
        (PULSED.replace(f"hold_s = {HOLD_S}", ""), "how long the board's monostable holds"),
        (TOLD + "hold_s = 1.0", "only a board that falls without pulses has it"),
    ],
)
def test_the_robot_file_says_how_long_a_board_holds(tmp_path, relay, words) -> None:
    with pytest.raises(RobotFileError, match=words):
        load_robot(robot_with(tmp_path / "arm", relay))


def test_feetech_servos_without_a_relay_are_named(tmp_path) -> None:
    assert "no relay is in their supply" in unguarded_servos(load_robot("so101"))
    assert unguarded_servos(load_robot(robot_with(tmp_path / "arm", PULSED))) == ""
    for guarded in ("koch_v1_1", "so101_leader"):
        assert unguarded_servos(load_robot(guarded)) == ""


def test_the_supervisor_sends_the_pulses_and_leaves_the_line_low(stage, step_until, tmp_path):
    folder, line = robot_with(tmp_path / "arm", PULSED), socket.socket(socket.AF_UNIX)
    devices = tmp_path / "dev"
    devices.mkdir()
    with line:
        line.bind(str(devices / "relay"))
        line.listen()
        table = stage.row("control", "control")
        with stage.supervisor(table, robot=str(folder), devices_dir=devices) as supervisor:
            supervisor.start()
            client, _ = line.accept()
            client.setblocking(False)
            levels = bytearray()

            def has_pulses() -> bool:
                with suppress(BlockingIOError):
                    levels.extend(client.recv(64))
                return levels.count(b"10") >= 3

            assert step_until(supervisor, has_pulses)
        with client:
            client.setblocking(True)
            levels.extend(client.recv(64))
    assert b"11" not in levels
    assert levels.endswith(b"0")
