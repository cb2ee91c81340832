"""A robot follows its leader through control's limits, and rests where the leader is lost."""

import json
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
import pytest

from tests.vla_deploy.teleoperation.conftest import FOLDED, MOTORS, SO101, HandledArm
from vla_deploy.cli.main import main
from vla_deploy.cli.operation import teleoperate
from vla_deploy.cli.session import RobotSession
from vla_deploy.teleoperation.jogging import JogWish
from vla_deploy.teleoperation.keyboard import Keyboard, key_table
from vla_deploy.teleoperation.leader_arm import LeaderArm, open_leader

AMPLITUDES = np.array([0.6, 0.5, -0.5, 0.3, 0.8, 0.5])
PERIOD_S = 2.4


def wave(at_s: float) -> np.ndarray:
    return FOLDED + AMPLITUDES * (1 - np.cos(2 * np.pi * at_s / PERIOD_S)) / 2


@pytest.fixture
def command(
    arm: HandledArm, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> Callable[..., tuple[int, str, str]]:
    """Return what runs the command beside the leader on the memory line."""
    session = RobotSession(arm.lockstep.context.run_dir, arm)
    arm.space.cell_writer("process_table").put_document({"robot": "so101"})

    @contextmanager
    def leader_of(*_: Any) -> Iterator[LeaderArm]:
        yield open_leader(arm.leader.bench(), arm, SO101, MOTORS, "feetech")

    @contextmanager
    def jog_input(*_: Any) -> Iterator[Keyboard]:
        ends = os.pipe()
        os.write(ends[1], b"q")  # counts for 0.3 s
        yield Keyboard(ends[0], arm, key_table(SO101.joint_names), JogWish())
        for one in ends:
            os.close(one)

    monkeypatch.setattr(teleoperate, "jog_input", jog_input)
    monkeypatch.setattr(teleoperate, "attach", lambda _: session)
    monkeypatch.setattr(teleoperate, "leader_of", leader_of)

    def run(*words: str) -> tuple[int, str, str]:
        arm.leader.begin()
        leader = ["--leader", "/dev/x", "--calibration", "x.json"]
        code = main(["teleoperate", *([] if "--keyboard" in words else leader), *words])
        return code, *capsys.readouterr()

    return run


def test_it_follows_within_a_tenth_of_a_second_and_rests_where_the_leader_is_unplugged(
    arm: HandledArm, command: Callable[..., tuple[int, str, str]]
) -> None:
    arm.leader.pose = wave
    arm.at(1.5, arm.leader.line.unplug)
    code, _, err = command()
    assert code == 1
    assert "the leader is lost: line to FeetechBank: unplugged" in err
    assert arm.seen[-1][0] < 1.6, "noticed at the next read"
    followed = [(at_s, seen) for at_s, seen, _ in arm.seen if at_s > 0.2]
    lags = np.arange(0.0, 0.2, 0.01)
    for row, joint in enumerate(SO101.joint_names):
        off = [
            np.mean([(seen[row] - wave(max(at_s - lag, 0.0))[row]) ** 2 for at_s, seen in followed])
            for lag in lags
        ]
        assert lags[int(np.argmin(off))] <= 0.1, joint
        assert min(off) ** 0.5 < 0.012, joint
    arm.lockstep.run_for(0.4)
    assert arm.speed() < 0.02
    assert arm.state() == "armed"
    assert not arm.leader.servos.bank.register(1, "torque_enable")


def test_a_leader_far_away_is_refused_or_approached_slowly_until_a_stop(
    arm: HandledArm, command: Callable[..., tuple[int, str, str]]
) -> None:
    far = FOLDED + np.array([0.3, 0, 0, 0, 0, 0])
    arm.leader.pose = lambda _: far
    arm.sleep_until(arm.now_ns() + 20_000_000)
    code, _, err = command()
    assert code == 1
    assert "shoulder_pan is 0.30 from the leader's, at most 0.2" in err
    arm.at(2.4, press_ctrl_c)
    code, out, err = command("--approach", "--json")
    assert (code, json.loads(out)["followed"]) == (0, True), err
    steps = np.diff([seen[0] for _, _, seen in arm.seen]) / 0.02
    assert 0.2 < steps.max() < 0.5, "about a fifth of 2 rad/s"
    assert arm.seen[-1][1][0] == pytest.approx(0.3, abs=0.02)
    before = arm.seen[-1][1][0]
    arm.at(0.5, press_ctrl_c)
    assert command("--keyboard")[0] == 0
    assert arm.seen[-1][1][0] == pytest.approx(before - 0.2, abs=0.03), "0.4 s at 0.5 rad/s"
    arm.leader.pose = lambda _: FOLDED + np.array([arm.seen[-1][2][0], 0, 0, 0, 0, 0])
    arm.sleep_until(arm.now_ns() + 20_000_000)
    moving = arm.leader.pose(0.0)

    def leave() -> None:
        moving[2] += 0.55

    arm.leader.pose = lambda _: moving
    arm.at(0.1, leave)
    code, _, err = command()
    assert code == 1
    assert "the leader's elbow_flex is at 2.0" in err
    moving[2] = far[2]
    arm.sleep_until(arm.now_ns() + 20_000_000)
    arm.leader.pose = lambda at_s: moving - np.array([0.5 * at_s, 0, 0, 0, 0, 0])
    arm.at(0.2, lambda: arm.operate("estop"))
    code, _, err = command()
    assert code == 1
    assert "the emergency stop is latched: reset, then arm; the joints come to rest" in err


def press_ctrl_c() -> None:
    raise KeyboardInterrupt
