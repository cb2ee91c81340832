"""An emulated leader whose shafts a test turns, and an SO-101 of the twin that follows it."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from drivers.clock import NS_PER_S, Clock
from drivers.servo.family import servo_family
from drivers.servo.tools.bench import ServoBench
from drivers.servo.tools.travel import CENTRE_PULSE, PULSE_RAD
from sim_twin.harness.lockstep_stack import LockstepControl
from sim_twin.ports.lines import MemoryLine
from sim_twin.servos.server import FreeFeetechServos, make_feetech_specs
from vla_deploy.ipc import ClaimBook
from vla_deploy.robots import load_robot
from vla_deploy.robots.calibration.lerobot_file import LeRobotMotor

SO101 = load_robot("so101")
FOLDED = np.array(list(SO101.poses["folded"].values()))
# The handle of the leader's gripper goes over 800 pulses, the gripper over its whole range.
MOTORS = {
    name: LeRobotMotor(id=row + 1, drive_mode=0, homing_offset=0, range_min=low, range_max=high)
    for row, (name, (low, high)) in enumerate(
        {
            **dict.fromkeys(SO101.joint_names[:5], (848, 3248)),
            "gripper": (2048, 2848),
        }.items()
    )
}


class HandClock:
    """Pass time only when a test says so, or a driver waits."""

    def __init__(self) -> None:
        self.time_ns = NS_PER_S

    def now_ns(self) -> int:
        return self.time_ns

    def sleep_until(self, deadline_ns: int) -> None:
        self.time_ns = max(self.time_ns, deadline_ns)


class EmulatedLeader:
    """Be six servos on a line; a hand has them where `pose` says at each moment."""

    def __init__(self, clock: Clock) -> None:
        self.servos = FreeFeetechServos(make_feetech_specs(6, ["STS3215-C044"]))
        self.line = MemoryLine(self.servos.bank, clock)
        self.pose: Callable[[float], np.ndarray] = lambda _: FOLDED
        self._clock = clock
        self._began_ns = clock.now_ns()

    def bench(self) -> ServoBench:
        return servo_family("feetech").bench(self.line, self._clock, 1_000_000)

    def turn(self) -> None:
        """Turn the shafts to where the hand has them now."""
        elapsed_s = (self._clock.now_ns() - self._began_ns) / NS_PER_S
        self.servos.rotors.position_rad[:] = shafts_of(self.pose(elapsed_s))
        self.servos.advance_to(self._clock.now_ns())

    def begin(self) -> None:
        """Count the pose's time from now."""
        self._began_ns = self._clock.now_ns()


def shafts_of(joints: np.ndarray) -> np.ndarray:
    """Return the angles of the leader's shafts at which the robot's joints have these values."""
    shafts = joints.copy()
    low, high = -0.174533, 1.745329  # the MJCF's range of the gripper: closed to open
    pulses = 2048 + 800 * (joints[5] - low) / (high - low)
    shafts[5] = (pulses - CENTRE_PULSE) * PULSE_RAD
    return shafts


class HandledArm(LockstepControl):
    """An armed SO-101 whose time passes while a command waits, with a leader beside it."""

    def __init__(self, tmp_path: Path) -> None:
        super().__init__(tmp_path, robot="so101", world="table")
        self.arm()
        self.go(SO101.poses["folded"])
        self.lockstep.run_for(2.0)
        self.leader = EmulatedLeader(self.clock)
        self.acts: dict[int, Callable[[], object]] = {}
        self.seen: list[tuple[float, np.ndarray, np.ndarray]] = []
        self._table = self.space.cell_writer("process_table")
        ClaimBook(self.space, self.clock).declare(dict.fromkeys(SO101.groups, 1))
        self.leader.turn()

    def now_ns(self) -> int:
        return self.clock.now_ns()

    def sleep_until(self, deadline_ns: int) -> None:
        self._table.put_document({"robot": "so101"})
        for at_ns in [one for one in self.acts if one <= deadline_ns]:
            self.acts.pop(at_ns)()
        self.lockstep.run_for((deadline_ns - self.now_ns()) / NS_PER_S)
        self.leader.turn()
        sample = self.link.fresh("joint_state")
        assert sample is not None
        at_s = (self.now_ns() - self.leader._began_ns) / NS_PER_S
        self.seen.append((at_s, sample.data["position"].copy(), sample.data["setpoint"].copy()))

    def at(self, seconds: float, act: Callable[[], object]) -> None:
        """Do something so long from now."""
        self.acts[self.now_ns() + round(seconds * NS_PER_S)] = act

    def speed(self) -> float:
        """Return that of the joint that is fastest."""
        return max(abs(one["velocity"]) for one in self.lockstep.truth()["joints"].values())


@pytest.fixture
def arm(tmp_path: Path) -> HandledArm:
    return HandledArm(tmp_path)
