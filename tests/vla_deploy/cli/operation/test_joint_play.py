"""Episodes are judged before anything moves, and go through control's own limits and safety."""

import itertools
import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from drivers.clock import NS_PER_S
from sim_twin.harness.lockstep_stack import LockstepControl
from vla_deploy.cli.errors import UsageError
from vla_deploy.cli.main import main
from vla_deploy.cli.operation import joint_play
from vla_deploy.cli.operation.joint_play import (
    path_of,
    require_followable,
    tolerance_of,
    within_limits,
)
from vla_deploy.cli.session import RobotSession
from vla_deploy.client.link import RobotLink
from vla_deploy.client.motions import Motions
from vla_deploy.client.path_player import PathPlayer, PlayedPath
from vla_deploy.client.path_windows import TimedPath
from vla_deploy.ipc import ClaimBook
from vla_deploy.robots import load_robot
from vla_deploy.robots.calibration.lerobot_units import LeRobotUnit, units_of
from vla_deploy.telemetry.lerobot.reader import EpisodeActions
from vla_deploy.telemetry.lerobot.writer import DatasetWriter

SO101 = load_robot("so101")
NAMES = tuple(joint + ".pos" for joint in SO101.joint_names)
AMPLITUDES = np.array([0.4, 0.3, -0.3, 0.2, 0.5, 0.3])
START = np.array(list(SO101.poses["folded"].values()))


def episode_of(
    joints: np.ndarray, names: tuple[str, ...] = NAMES, unit: LeRobotUnit = LeRobotUnit.DEGREES
) -> EpisodeActions:
    actions = units_of(SO101, unit).to_lerobot(joints)
    return EpisodeActions(index=0, tasks=("wave",), fps=30.0, names=names, actions=actions)


def waves(duration_s: float = 6.0, period_s: float = 3.0) -> np.ndarray:
    at_s = np.arange(0.0, duration_s, 1 / 30)[:, None]
    return START + AMPLITUDES * (1 - np.cos(2 * np.pi * at_s / period_s)) / 2


def played(joints: np.ndarray, speed: float = 1.0) -> TimedPath:
    path = path_of(SO101, episode_of(joints), LeRobotUnit.DEGREES, speed)
    return within_limits(SO101, path, clip=False).thinned()


@pytest.mark.parametrize("unit", list(LeRobotUnit))
def test_an_episode_becomes_the_joints_of_the_robot(unit: LeRobotUnit) -> None:
    path = path_of(SO101, episode_of(waves(), unit=unit), unit, 0.5)
    np.testing.assert_allclose(path.positions, waves(), atol=1e-9)
    assert path.frames_per_s == 15.0


@pytest.mark.parametrize(
    ("names", "words"),
    [
        ((*NAMES[:5], "jaw.pos"), "the dataset's actions are .*jaw.pos; expected those of so101"),
        ((*NAMES[:5], NAMES[0]), "expected those of so101: shoulder_pan.pos"),
    ],
)
def test_an_episode_of_other_joints_is_refused(names: tuple[str, ...], words: str) -> None:
    with pytest.raises(UsageError, match=words):
        path_of(SO101, episode_of(waves(), names), LeRobotUnit.DEGREES, 1.0)


def test_an_episode_beyond_the_limits_is_refused_or_clipped() -> None:
    far = waves()
    far[40:50, 0] = 1.9  # its limit is 1.889
    path = path_of(SO101, episode_of(far), LeRobotUnit.DEGREES, 1.0)
    words = r"frame 4\d: shoulder_pan goes to 1.900, expected -1.889 to 1.889; 10 frames leave"
    with pytest.raises(UsageError, match=words):
        within_limits(SO101, path, clip=False)
    clipped = within_limits(SO101, path, clip=True)
    assert clipped.positions.max() == pytest.approx(1.889)


def test_what_control_would_refuse_is_refused_before_with_a_speed_that_helps() -> None:
    require_followable(SO101, played(waves()), 1.0)
    fast = played(waves(3.0, 0.5))
    with pytest.raises(UsageError, match=r"too fast: .*; at --speed 0.5 the joints can follow"):
        require_followable(SO101, fast, 1.0)
    require_followable(SO101, played(waves(3.0, 0.5), 0.5), 0.5)
    leap = waves()
    leap[:, 0] = np.repeat([-1.2, 1.2], len(leap) // 2)
    with pytest.raises(UsageError, match="it leaps: no --speed helps"):
        require_followable(SO101, played(leap), 1.0)


@pytest.fixture
def arm(tmp_path: Path) -> LockstepControl:
    stack = LockstepControl(tmp_path, robot="so101", world="table")
    stack.arm()
    return stack


def play(
    arm: LockstepControl, path: TimedPath, meanwhile: Callable[[], None] = lambda: None
) -> PlayedPath:
    link = RobotLink(arm.lockstep.context.run_dir, arm.clock, source="test")
    motions = Motions(link, SO101.joint_index, "cli")

    def wait() -> None:
        meanwhile()
        arm.lockstep.run_for(0.02)

    motion_id = motions.go(dict(zip(path.joints, path.positions[0], strict=True)), {})
    while motions.ended(motion_id) is None:
        arm.lockstep.run_for(0.02)
        motions.step()
    result = PathPlayer(motions, arm.clock, path, tolerance_of(SO101, path)).play(wait)
    motions.close()
    return result


class WaitingClock:
    """Run the robot, under a supervisor, while somebody waits."""

    def __init__(self, arm: LockstepControl) -> None:
        self._arm = arm
        self.acts: dict[int, Callable[[], None]] = {}
        self._table = arm.space.cell_writer("process_table")
        self._table.put_document({"robot": "so101"})

    def now_ns(self) -> int:
        return self._arm.clock.now_ns()

    def sleep_until(self, deadline_ns: int) -> None:
        self._table.put_document({"robot": "so101"})
        for at_ns in [one for one in self.acts if one <= deadline_ns]:
            self.acts.pop(at_ns)()
        self._arm.lockstep.run_for((deadline_ns - self.now_ns()) / NS_PER_S)


def test_a_dataset_is_played_on_the_arm(
    arm: LockstepControl,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    pytest.importorskip("pyarrow", reason="datasets need the extra: vla-deploy[lerobot]")
    with DatasetWriter(
        tmp_path / "set", names=NAMES, cameras=[], fps=30, robot_type="so_follower"
    ) as writer:
        for values in episode_of(waves(4.5)).actions:
            writer.add_frame(values, values, {})
        writer.end_episode("wave")
    clock = WaitingClock(arm)
    session = RobotSession(arm.lockstep.context.run_dir, clock)
    plans = arm.space.ring_writer("plan")
    monkeypatch.setattr(joint_play, "attach", lambda _: session)
    ClaimBook(arm.space, arm.clock).declare(dict.fromkeys(SO101.groups, 1))
    words = ["joint", "play", str(tmp_path / "set")]
    assert main([*words, "--episode", "1"]) == 2
    assert "no episode 1; there are 0 to 0" in capsys.readouterr().err
    assert main([*words, "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert (document["frames"], document["pauses"]) == (135, 0)
    assert document["setpoint_error"] < 0.01
    assert document["position_error"] < 0.05
    at = arm.clock.now_ns() + NS_PER_S
    clock.acts[at] = lambda: plans.publish({"command_id": "c1", "cancel": True})
    assert main(words) == 1
    assert "stopped on request" in capsys.readouterr().err
    arm.operate("estop")
    arm.lockstep.run_for(0.1)
    assert main(words) == 1
    assert "reset and arm it" in capsys.readouterr().err


def test_after_a_late_takeover_it_goes_on_from_rest_until_an_emergency_stop(
    arm: LockstepControl,
) -> None:
    acts = {10: lambda: arm.lockstep.run_for(3.6), 40: lambda: arm.operate("estop")}
    count = itertools.count()
    result = play(arm, played(waves(6.0)), lambda: acts.get(next(count), lambda: None)())
    assert (result.ended.status, result.pauses) == ("stopped", 1)
    assert 75 < result.frame < 120
