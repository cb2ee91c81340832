"""Read a leader arm: an arm without torque that a person moves. Nothing is written to it."""

from collections import deque
from collections.abc import Mapping, Sequence
from typing import Final, Protocol

import numpy as np

from drivers.clock import NS_PER_S, Clock
from drivers.errors import DriverError
from drivers.servo.joint_servo import JointServo
from drivers.servo.tools.bench import ServoBench
from vla_deploy.robots import RobotDescription
from vla_deploy.robots.calibration.lerobot_file import LeRobotMotor
from vla_deploy.teleoperation.errors import HandMotionEnded, LeaderUnusable
from vla_deploy.teleoperation.hand_pose import Floats, HandPose
from vla_deploy.teleoperation.leader_scale import LeaderScale, held_offset

SILENT_S: Final = 0.15
"""So long without a whole and credible pose, and the leader is lost: seven reads at 50 Hz."""
JUMP_RAD: Final = 0.6
"""Of a servo between two reads, 20 ms apart: 30 rad/s, which no hand reaches."""
_VELOCITY_SAMPLES: Final = 4
"""60 ms at 50 Hz: one pulse is then 0.026 rad/s."""


class PulseScale(Protocol):
    """Convert the pulses of a leader's servos into joint values of the robot that follows."""

    @property
    def joints(self) -> Sequence[str]:
        """Return the joints, in the order of the servos."""
        ...

    def to_joints(self, pulses: Floats) -> Floats:
        """Return the values of `joints`."""
        ...


class LeaderArm:
    """Declare what a person moves by hand: a pose in joint values of the robot that follows."""

    def __init__(
        self, bench: ServoBench, clock: Clock, servos: Sequence[JointServo], scale: PulseScale
    ) -> None:
        """Take servos in the order of the scale's joints."""
        self.missed = 0
        """Reads that gave no whole pose."""
        self._bench = bench
        self._clock = clock
        self._servos = servos
        self._scale = scale
        self._pulses: Floats | None = None
        self._taken: deque[tuple[int, Floats]] = deque(maxlen=_VELOCITY_SAMPLES)
        self._since_ns = clock.now_ns()

    @property
    def joints(self) -> Sequence[str]:
        """Return the joints that it has."""
        return self._scale.joints

    def read(self) -> HandPose | None:
        """Return the pose and its velocity, or None where a servo gave none this time.

        Raises:
            HandMotionEnded: it is unplugged, silent for `SILENT_S`, or its values jumped.
        """
        try:
            found = self._bench.positions(self._servos)
        except DriverError as error:
            raise HandMotionEnded(f"the leader is lost: {error}") from error
        now_ns = self._clock.now_ns()
        doubt = self._doubt(found)
        if doubt:
            self.missed += 1
            if now_ns - self._since_ns > SILENT_S * NS_PER_S:
                raise HandMotionEnded(f"the leader is lost: {doubt}")
            return None
        self._since_ns = now_ns
        self._pulses = self._in_order(found)
        position = self._scale.to_joints(self._pulses)
        self._taken.append((now_ns, position))
        return HandPose(position=position, velocity=self._velocity())

    def _doubt(self, found: Mapping[int, int]) -> str:
        """Return why a read is no pose, or ""."""
        silent = [str(servo) for servo in self._servos if servo.id not in found]
        if silent:
            return f"{', '.join(silent)} gave no position for {SILENT_S:g} s; power, cable"
        if self._pulses is None:
            return ""
        steps = np.array([servo.pulse_rad for servo in self._servos])
        turns = np.array([round(2 * np.pi / one) for one in steps])
        moved = self._in_order(found) - self._pulses
        moved_rad = np.abs((moved + turns / 2) % turns - turns / 2) * steps
        worst = int(moved_rad.argmax())
        if moved_rad[worst] > JUMP_RAD:
            return (
                f"{self._servos[worst]} jumped by {moved_rad[worst]:.2f} rad between two reads; "
                "plugs, or a servo that was restarted"
            )
        return ""

    def _in_order(self, found: Mapping[int, int]) -> Floats:
        return np.array([found[servo.id] for servo in self._servos], dtype=np.float64)

    def _velocity(self) -> Floats:
        (first_ns, first), (last_ns, last) = self._taken[0], self._taken[-1]
        if last_ns <= first_ns:
            return np.zeros_like(last)
        velocity: Floats = (last - first) * NS_PER_S / (last_ns - first_ns)
        return velocity


def open_leader(
    bench: ServoBench,
    clock: Clock,
    robot: RobotDescription,
    motors: Mapping[str, LeRobotMotor],
    family: str,
) -> LeaderArm:
    """Find the servos of a leader and check that they have no torque; nothing is written.

    Raises:
        LeaderUnusable: a servo has torque, or the calibration is of another arm.
        DriverError: a servo is silent or of an unknown model.
    """
    servos = {name: bench.servo(motor.id, name) for name, motor in motors.items()}
    require_free(bench, servos)
    held = {name: held_offset(bench, servo) for name, servo in servos.items()}
    scale = LeaderScale(robot, motors, held, family)
    return LeaderArm(bench, clock, [servos[name] for name in scale.joints], scale)


def require_free(bench: ServoBench, servos: Mapping[str, JointServo]) -> None:
    """Check that no servo has torque.

    Raises:
        LeaderUnusable: one has.
        DriverError: one is silent.
    """
    powered = [name for name, servo in servos.items() if bench.torque_is_on(servo)]
    if powered:
        raise LeaderUnusable(
            f"{', '.join(powered)}: torque is on, so this is no leader that a hand can move; is it "
            "the robot's own port? If not, end what switched it on, then cut the leader's power"
        )
