"""Give the tests a robot in the twin, in lock-step, with the far ends of control's topics."""

from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from platforms import load_profile
from sim_twin.harness.lockstep import Lockstep
from sim_twin.twin import Twin
from vla_deploy.control.node import ControlNode
from vla_deploy.ipc import SharedSpace
from vla_deploy.ipc.topics import SCAN_BEAMS
from vla_deploy.robots import load_robot

SINKS_FOR_S = 2.5
START: dict[str, Any] = {"x_m": 1.0, "y_m": 1.0, "yaw_rad": 0.0, "match_ratio": 1.0}
START |= {"covariance": (0.0,) * 9, "state": 0, "doubt": 0}
LEVEL = {"yaw_rad": 0.0, "pitch_rad": 0.0, "roll_rad": 0.0, "acceleration_m_s2": (0.0, 0.0, 9.81)}
_NO_POINTS: dict[str, Any] = {"x_m": (), "y_m": (), "z_m": ()}


@cache
def at_rest() -> dict[str, float]:
    """Return where the joints have sunk to, without power, before a robot is switched on."""
    twin = Twin(load_robot("butler"))
    start_ns = twin.now_ns
    while twin.now_ns < start_ns + SINKS_FOR_S * 1e9:
        twin.step()
    joints = twin.engine.referee.truth()["joints"]
    assert max(abs(joint["velocity"]) for joint in joints.values()) < 0.01
    return {name: joint["position"] for name, joint in joints.items()}


class EmptyFloor:
    """Publish what perception tells, with nothing around at first, of the topics in `sees`."""

    period_s = 0.1

    def __init__(self, space: SharedSpace) -> None:
        self.ranges_m = np.full(SCAN_BEAMS, 8.0)
        self.look_period_s = 0.2
        self.sees = {"scan", "near_obstacles", "pose", "imu"}
        self._writers = {name: space.cell_writer(name) for name in sorted(self.sees)}

    def start(self) -> None:
        """Have nothing to open."""

    def step(self) -> None:
        """Put one sample of each."""
        told: dict[str, dict[str, Any]] = {
            "scan": {"range_m": self.ranges_m, "beam_age_s": ()},
            "near_obstacles": {"count": 0, "period_s": self.look_period_s} | _NO_POINTS,
            "pose": START,
            "imu": LEVEL,
        }
        for name in self.sees:
            self._writers[name].put(**told[name])

    def stop(self) -> None:
        """Have nothing to close."""


class Rig:
    """Hold the twin, control, and what its neighbours would read and write."""

    def __init__(self, tmp_path: Path) -> None:
        self.lockstep = Lockstep(tmp_path=tmp_path)
        self.lockstep.twin.engine.pose(at_rest())
        self.robot = self.lockstep.robot
        space = SharedSpace(tmp_path / "ipc", self.lockstep.clock)
        self._operator = space.ring_writer("operator")
        self._commands = space.ring_writer("motion_command")
        self._results = space.ring_reader("motion_result", from_start=True)
        self._joints = space.cell_reader("joint_state")
        self._base = space.cell_reader("base_state")
        self._status = space.cell_reader("control_status")
        self._base_command = space.cell_writer("base_command")
        self.process_table = space.cell_writer("process_table")
        self.lidar = EmptyFloor(space)
        self.space = space
        self.control = self.new_control()

    def new_control(self) -> ControlNode:
        step = self.lockstep
        return ControlNode(step.context, self.robot, load_profile("desktop"), step.devices)

    def boot(self) -> None:
        """Start control; the arms, without power, lie at rest."""
        self.lockstep.add(self.lidar)
        self.lockstep.add(self.control)
        self.run(0.1)

    def run(self, seconds: float) -> None:
        self.lockstep.run_for(seconds)

    def tick(self) -> None:
        self.lockstep.run_for(self.control.period_s)

    def ask(self, *acts: str, within_s: float = 0.6) -> None:
        for act in acts:
            self.publish(act)
        self.run(within_s)

    def publish(self, act: str) -> None:
        self._operator.publish({"act": act, "source": "test", "reason": ""})

    def send(self, **command: Any) -> None:
        self._commands.publish(command)

    def go(self, motion_id: int, speed_ratio: float = 1.0, **targets: float) -> None:
        self.send(kind="goal", motion_id=motion_id, targets=targets, speed_ratio=speed_ratio)

    def results(self) -> list[dict[str, Any]]:
        return [event.payload for event in self._results.drain()]

    def column(self, name: str) -> NDArray[np.float64]:
        sample = self._joints.latest()
        assert sample is not None
        return np.array(sample.data[name][: len(self.robot.joint_names)], dtype=np.float64)

    def joint(self, name: str, column: str = "position") -> float:
        return float(self.column(column)[self.robot.joint_index[name]])

    def true_speeds(self) -> NDArray[np.float64]:
        joints = self.lockstep.truth()["joints"]
        return np.abs([joints[name]["velocity"] for name in self.robot.joint_names])

    def drive(self, v_m_s: float, w_rad_s: float, seconds: float) -> None:
        for _ in range(round(seconds / 0.02)):
            self._base_command.put(v_m_s=v_m_s, w_rad_s=w_rad_s)
            self.run(0.02)

    def base(self) -> dict[str, float]:
        sample = self._base.latest()
        assert sample is not None
        names = ("x_m", "y_m", "yaw_rad", "v_m_s", "w_rad_s", "enabled")
        return {name: float(sample.data[name]) for name in names}

    @property
    def status(self) -> dict[str, Any]:
        sample = self._status.latest()
        assert sample is not None
        return sample.document()

    @property
    def state(self) -> str:
        return str(self.status["state"])


@pytest.fixture
def rig(tmp_path: Path) -> Iterator[Rig]:
    rig = Rig(tmp_path)
    yield rig
    rig.lockstep.close()


@pytest.fixture
def armed(rig: Rig) -> Rig:
    rig.boot()
    rig.publish("arm")
    assert rig.lockstep.run_until(lambda: rig.state == "armed", 0.6), rig.status
    rig.run(0.1)
    return rig
