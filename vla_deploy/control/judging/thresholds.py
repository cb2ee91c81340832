"""Derive the limits of the safety rules from robot file, servo datasheets and topics."""

import numpy as np

from drivers.servo.family import family_of
from vla_deploy.control.motion.axes import Floats
from vla_deploy.ipc import BY_NAME
from vla_deploy.robots import RobotDescription
from vla_deploy.robots.protection import ZoneSource
from vla_deploy.robots.supplies import voltage_range_v
from vla_deploy.safety import SafetyLimits

_RANGE_MARGIN = 0.02
_OUTWARD_SHARE = 0.05
_OVERSPEED = 2.0
# Servos that answer late and early tell several cycles' way at once.
_POSITION_JUMP_RAD = 0.08
_FOLLOWING_ERROR_RAD = 0.4
_WHEEL_ERROR_OF_TOP = 0.05
_WHEEL_ERROR_OF_COMMAND = 0.5
# A servo shuts down by itself at its own limits: we stop before it lets go.
_TEMPERATURE_MARGIN_C = 5.0
_VOLTAGE_MARGIN_V = 0.3
_EFFORT_RATIO = 0.9
_STANDSTILL_SHARE = 0.1
_STANDSTILL_WHEEL_M_S = 0.01
# Slower than this it does not approach: it is the play of what is measured.
_APPROACH_M_S = 0.01
# Perception tells scan, pose and attitude from the same steps: one held up holds up all of them.
POSE_AGE_S = IMU_AGE_S = BY_NAME["scan"].deadline_s


def safety_limits(robot: RobotDescription) -> SafetyLimits:
    """Return the thresholds of the safety rules for a robot.

    A gripper has no following error: closed on an object it is blocked by intent. A wheel may be
    off by a twentieth of its top speed, at which the base creeps, and by half of what it is told:
    it lags while it speeds up, and strains on a carpet's edge. One that stands or runs away is
    beyond that. A sense that nothing in the robot file is judged by may be silent.
    """
    margin = _RANGE_MARGIN * (robot.position_max - robot.position_min)
    facts = [family_of(servo.model).facts(servo.model) for servo in robot.servo_bus.servos]
    bus = robot.servo_bus
    ranges_v = [voltage_range_v(bus, servo, _VOLTAGE_MARGIN_V) for servo in bus.servos]
    lowest_v, highest_v = np.array(ranges_v).T
    tip_over, base, home = robot.protection.tip_over, robot.parts.base, robot.parts.home
    return SafetyLimits(
        joint_names=robot.joint_names,
        position_lower=robot.position_min - margin,
        position_upper=robot.position_max + margin,
        outward_velocity=_OUTWARD_SHARE * robot.velocity_max,
        velocity=_OVERSPEED * robot.velocity_max,
        position_jump=np.array(
            [_POSITION_JUMP_RAD * servo.travel_per_rad for servo in robot.servo_bus.servos]
        ),
        following_error=_following_error(robot),
        wheel_error_rad_s=_WHEEL_ERROR_OF_TOP * base.max_speed_m_s / base.wheel_radius_m
        if base
        else np.inf,
        wheel_error_ratio=_WHEEL_ERROR_OF_COMMAND,
        servo_age_s=BY_NAME["joint_state"].deadline_s,
        base_command_age_s=BY_NAME["base_command"].deadline_s,
        supervisor_age_s=BY_NAME["process_table"].deadline_s,
        effort_ratio=np.full(len(robot.joint_names), _EFFORT_RATIO),
        temperature_c=np.array([each.temperature_limit_c for each in facts])
        - _TEMPERATURE_MARGIN_C,
        voltage_min_v=lowest_v,
        voltage_max_v=highest_v,
        standstill_velocity=_STANDSTILL_SHARE * robot.velocity_max,
        standstill_wheel_rad_s=_STANDSTILL_WHEEL_M_S / base.wheel_radius_m if base else np.inf,
        scan_required=robot.parts.lidar is not None,
        scan_age_s=BY_NAME["scan"].deadline_s,
        depth_age_s=BY_NAME["near_obstacles"].deadline_s if _looks_by_depth(robot) else np.inf,
        pose_age_s=POSE_AGE_S if home and home.zones else np.inf,
        imu_age_s=IMU_AGE_S if tip_over else np.inf,
        keep_out_depth_m=0.0,
        workspace_excess_m=0.0,
        self_clearance_m=robot.protection.clearance.self_m,
        environment_clearance_m=robot.protection.clearance.floor_m,
        approach_m_s=_APPROACH_M_S,
        tip_margin_ratio=tip_over.min_ratio if tip_over else 0.0,
        external_torque_nm=contact_torque(robot),
        tip_slow_below_ratio=tip_over.slow_below_ratio if tip_over else 0.0,
    )


def _looks_by_depth(robot: RobotDescription) -> bool:
    return any(ZoneSource.DEPTH in zone.sources for zone in robot.protection.zones)


def _following_error(robot: RobotDescription) -> Floats:
    grippers = robot.gripper_joints
    return np.array(
        [
            np.inf if servo.joint in grippers else _FOLLOWING_ERROR_RAD * servo.travel_per_rad
            for servo in robot.servo_bus.servos
        ]
    )


def contact_torque(robot: RobotDescription) -> Floats:
    """Return each joint's contact limit; a joint for which none is declared is not judged."""
    contact = robot.protection.contact
    declared = {} if contact is None else contact.torque_nm
    return np.array([declared.get(name, np.inf) for name in robot.joint_names])
