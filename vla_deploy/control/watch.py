"""Gather what the safety judge sees each tick, and its limits from robot and topics."""

import numpy as np

from drivers.clock import Clock
from vla_deploy.control.axes import Floats
from vla_deploy.control.servos import ServoLine
from vla_deploy.control.wheels import Wheels
from vla_deploy.ipc import BY_NAME, SharedSpace
from vla_deploy.robots import RobotDescription
from vla_deploy.safety import SafetyInputs, SafetyLimits

_RANGE_MARGIN = 0.02
_OUTWARD_SHARE = 0.05
_OVERSPEED = 2.0
_FOLLOWING_ERROR_RAD = 0.4
_WHEEL_ERROR_OF_TOP = 0.05
_WHEEL_ERROR_OF_COMMAND = 0.5


def safety_limits(robot: RobotDescription) -> SafetyLimits:
    """Return the thresholds of the safety rules for a robot.

    A gripper has no following error: closed on an object it is blocked by intent. A wheel may be
    off by a twentieth of its top speed, at which the base creeps, and by half of what it is told:
    it lags while it speeds up, and strains on a carpet's edge. One that stands or runs away is
    beyond that.
    """
    margin = _RANGE_MARGIN * (robot.position_max - robot.position_min)
    grippers = {
        joint for hand in robot.hands.values() for joint in robot.group(hand.gripper).joints
    }
    following = [
        np.inf if servo.joint in grippers else _FOLLOWING_ERROR_RAD * servo.travel_per_rad
        for servo in robot.servo_bus.servos
    ]
    return SafetyLimits(
        joint_names=robot.joint_names,
        position_lower=robot.position_min - margin,
        position_upper=robot.position_max + margin,
        outward_velocity=_OUTWARD_SHARE * robot.velocity_max,
        velocity=_OVERSPEED * robot.velocity_max,
        following_error=np.array(following),
        wheel_error_rad_s=_WHEEL_ERROR_OF_TOP
        * robot.base.max_speed_m_s
        / robot.base.wheel_radius_m,
        wheel_error_ratio=_WHEEL_ERROR_OF_COMMAND,
        servo_age_s=BY_NAME["joint_state"].deadline_s,
        base_command_age_s=BY_NAME["base_command"].deadline_s,
        supervisor_age_s=BY_NAME["process_table"].deadline_s,
    )


class Watch:
    """Read the cells that control depends on, and put a tick's measurements together."""

    def __init__(self, space: SharedSpace, servos: ServoLine, wheels: Wheels, clock: Clock) -> None:
        self.v_m_s = 0.0
        self.w_rad_s = 0.0
        self._base_command = space.cell_reader("base_command")
        self._process_table = space.cell_reader("process_table")
        self._servos = servos
        self._wheels = wheels
        self._clock = clock
        self._base_sequence = 0
        self._base_age_s: float | None = None
        self._quiet = np.zeros(len(servos.state.torque_on), dtype=np.bool_)

    def refresh(self) -> None:
        """Take in the newest base command."""
        sample = self._base_command.latest()
        if sample is None:
            return
        self._base_age_s = sample.age_s(self._clock.now_ns())
        if sample.sequence != self._base_sequence:
            self._base_sequence = sample.sequence
            v_m_s, w_rad_s = float(sample.data["v_m_s"]), float(sample.data["w_rad_s"])
            valid = np.isfinite(v_m_s) and np.isfinite(w_rad_s)
            self.v_m_s, self.w_rad_s = (v_m_s, w_rad_s) if valid else (0.0, 0.0)

    def inputs(
        self,
        *,
        energised: bool,
        estop_source: str | None,
        reset_requested: bool,
        setpoint: Floats,
        base_at_rest: bool,
    ) -> SafetyInputs:
        """Return the tick's measurements.

        Tripped watchdogs do not hold up a reset: the servos go on holding until arming clears
        them. What arming clears by itself, and a stale command, is judged only while energised.
        """
        state = self._servos.state
        guarded = energised and not reset_requested
        commanded = not base_at_rest or self.v_m_s != 0.0 or self.w_rad_s != 0.0
        return SafetyInputs(
            energised=energised,
            estop_source=estop_source,
            reset_requested=reset_requested,
            position=state.position_rad,
            velocity=state.velocity_rad_s,
            setpoint=setpoint,
            torque_enabled=state.torque_on,
            sample_age_s=state.age_s,
            hardware_error=state.error,
            watchdog_tripped=self._servos.watchdog_tripped if guarded else self._quiet,
            lost_servo_buses=self._servos.lost_parts,
            lost_can_buses=(self._wheels.name,) if self._wheels.lost else (),
            drives=self._wheels.samples() if energised else (),
            base_moving=energised and commanded,
            base_command_age_s=self._base_age_s,
            supervisor_age_s=self._supervisor_age_s(),
        )

    def _supervisor_age_s(self) -> float | None:
        sample = self._process_table.latest()
        return None if sample is None else sample.age_s(self._clock.now_ns())

    def close(self) -> None:
        """Unmap the topics."""
        self._base_command.close()
        self._process_table.close()
