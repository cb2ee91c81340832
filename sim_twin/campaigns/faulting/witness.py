"""Watch a robot in lock-step while a fault is on: what it tells, and what really moves."""

import math
from collections.abc import Callable
from functools import partial
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from drivers.clock import NS_PER_S
from sim_twin.faults.scenario import NO_CAUSE
from sim_twin.harness.lockstep_stack import LockstepControl
from sim_twin.physics.truth import STANDSTILL_RAD_S
from vla_deploy.ipc import BY_NAME, topics

SENSOR_CELLS: Final = ("scan", "imu", "pose")
_IMAGES: Final = "rgbd"


class FaultWitness:
    """Collect what a judge needs; all times count from the fault's beginning.

    `parts` are the joints that must come to rest. `cause_s` and `rest_s` are NaN as long as there
    is nothing to tell.
    """

    def __init__(self, stack: LockstepControl, begin_s: float, parts: tuple[str, ...]) -> None:
        self.cause = NO_CAUSE
        self.cause_s = math.nan
        self.rest_s = math.nan
        self.worst_pose_m = 0.0
        self.worst_yaw_rad = 0.0
        self.aged: set[str] = set()
        self.alerts: set[str] = set()
        self.silent: set[str] = set()
        self.states: set[str] = set()
        self._stack = stack
        self._begin_s = begin_s
        model = stack.lockstep.twin.engine.model
        self._dofs = [int(model.joint(part).dofadr[0]) for part in parts]
        self._places = [int(model.joint(part).qposadr[0]) for part in parts]
        self._joints = stack.space.cell_reader(topics.JOINT_STATE)
        self._pose = stack.space.cell_reader(topics.POSE)
        self._topics = _topics(stack)

    @property
    def since_s(self) -> float:
        """Return the time since the fault's beginning."""
        return self._stack.lockstep.now_s - self._begin_s

    def look(self) -> None:
        """Look once, a few milliseconds after the last time."""
        self._look_at_status()
        self._look_at_joints()
        self.look_at_pose()
        self.silent |= {name for name, age_s in self._topics.items() if age_s() > _limit_s(name)}
        if self.speed_rad_s() > STANDSTILL_RAD_S:
            self.rest_s = math.nan
        elif math.isnan(self.rest_s):
            self.rest_s = self.since_s

    def look_at_pose(self) -> None:
        """Compare the pose that perception tells with the true one."""
        sample = self._pose.latest()
        if sample is not None:
            true = self._stack.lockstep.truth()["robot"]
            x_m, y_m, yaw = (float(sample.data[a]) - true[a] for a in ("x_m", "y_m", "yaw_rad"))
            self.worst_pose_m = max(self.worst_pose_m, math.hypot(x_m, y_m))
            self.worst_yaw_rad = max(self.worst_yaw_rad, abs(math.remainder(yaw, math.tau)))

    def speed_rad_s(self) -> float:
        """Return the speed of the fastest part."""
        speeds = self._stack.lockstep.twin.engine.data.qvel[self._dofs]
        return float(np.abs(speeds).max(initial=0.0))

    def where(self) -> NDArray[np.float64]:
        """Return where the parts are."""
        places: NDArray[np.float64] = self._stack.lockstep.twin.engine.data.qpos[self._places]
        return places

    def counters(self) -> dict[str, int]:
        """Return what control's buses have counted, as "servos.crc_errors"."""
        buses = self._stack.status()["buses"]
        return {f"{bus}.{name}": n for bus, counts in buses.items() for name, n in counts.items()}

    def torques(self) -> dict[str, bool]:
        """Return which servos hold torque, by their own registers."""
        twin = self._stack.lockstep.twin
        return {
            servo.joint: bool(twin.servos.register(servo.id, "torque_enable"))
            for servo in twin.robot.servo_bus.servos
        }

    def _look_at_status(self) -> None:
        status = self._stack.status()
        self.states.add(str(status["state"]))
        if math.isnan(self.cause_s) and status["cause"]:
            self.cause, self.cause_s = str(status["cause"]), self.since_s

    def _look_at_joints(self) -> None:
        sample = self._joints.latest()
        assert sample is not None, "control has armed, so it has told its joints"
        names = self._stack.robot.joint_names
        age_s, error = sample.data["age_s"], sample.data["error"]
        self.aged |= {name for n, name in enumerate(names) if age_s[n] > _limit_s("joint_state")}
        self.alerts |= {name for n, name in enumerate(names) if error[n]}


def _topics(stack: LockstepControl) -> dict[str, Callable[[], float]]:
    """Return how old the newest of each sensor's topics is; infinite before the first."""
    latest: dict[str, Callable[[], Any]] = {
        name: stack.space.cell_reader(name).latest for name in SENSOR_CELLS
    }
    latest[_IMAGES] = stack.space.frame_reader(_IMAGES).latest
    return {name: partial(_age_s, stack, newest) for name, newest in latest.items()}


def _age_s(stack: LockstepControl, latest: Callable[[], Any]) -> float:
    newest = latest()
    now_ns = stack.lockstep.clock.now_ns()
    return math.inf if newest is None else (now_ns - newest.stamp_ns) / NS_PER_S


def _limit_s(topic: str) -> float:
    return BY_NAME[topic].deadline_s
