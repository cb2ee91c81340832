"""Declare which cause leads to which reaction: the one table of the safety rules.

A late tick is no cause of its own: the servos' Bus Watchdog and the drives' heartbeat judge
silence where it matters, and `servo_watchdog_tripped` brings the answer back.
"""

from dataclasses import dataclass
from enum import Enum, IntEnum, auto

from vla_deploy.robots.protection import ZoneKind
from vla_deploy.safety import probes
from vla_deploy.safety import surroundings_probes as around
from vla_deploy.safety.findings import Probe


class Reaction(IntEnum):
    """Order what may be done about a cause, the most restrictive last.

    BASE_SLOW bounds the base's speed, BASE_BLOCK forbids some of its motions as well; BASE_RAMP
    brings it to rest; all three leave the joints alone. PROTECTIVE_STOP is a controlled stop of
    everything under power, with monitored standstill, that ends with its cause. HOLD is the same
    stop (category 2 everywhere) for a person to end. BASE_OFF is HOLD for the joints, while the
    wheels brake by themselves and lose power, for they do not do as they are told. GROUP_STOP stops
    every joint group by the category that the robot file gives it.
    """

    NONE = 0
    BASE_SLOW = 1
    BASE_BLOCK = 2
    BASE_RAMP = 3
    PROTECTIVE_STOP = 4
    HOLD = 5
    BASE_OFF = 6
    GROUP_STOP = 7


class Cause(Enum):
    """Name everything that may stop the robot."""

    NONE = "none"
    ESTOP = "estop"
    STANDSTILL_MOTION = "standstill_motion"
    SERVO_BUS_LOST = "servo_bus_lost"
    CAN_BUS_LOST = "can_bus_lost"
    SERVO_HARDWARE_ERROR = "servo_hardware_error"
    DRIVE_FAULT = "drive_fault"
    SERVO_WATCHDOG_TRIPPED = "servo_watchdog_tripped"
    JOINT_UNPOWERED = "joint_unpowered"
    ENCODER_JUMP = "encoder_jump"
    JOINT_POSITION_LIMIT = "joint_position_limit"
    JOINT_VELOCITY_LIMIT = "joint_velocity_limit"
    FOLLOWING_ERROR = "following_error"
    WHEEL_FOLLOWING_ERROR = "wheel_following_error"
    JOINT_CURRENT_LIMIT = "joint_current_limit"
    JOINT_TEMPERATURE_LIMIT = "joint_temperature_limit"
    COLLISION = "collision"
    SUPERVISOR_LOST = "supervisor_lost"
    JOINT_VOLTAGE_LIMIT = "joint_voltage_limit"
    SELF_COLLISION = "self_collision"
    ENVIRONMENT_COLLISION = "environment_collision"
    WORKSPACE = "workspace"
    TIP_OVER = "tip_over"
    BUDGET_EXHAUSTED = "budget_exhausted"
    STALE_SCAN = "stale_scan"
    STALE_DEPTH = "stale_depth"
    STALE_POSE = "stale_pose"
    STALE_IMU = "stale_imu"
    STALE_COMMAND = "stale_command"
    KEEP_OUT_ZONE = "keep_out_zone"
    OBSTACLE_STOP_ZONE = "obstacle_stop_zone"
    TIP_MARGIN = "tip_margin"
    OBSTACLE_SLOW_ZONE = "obstacle_slow_zone"
    OBSTACLE_LIMIT_ZONE = "obstacle_limit_zone"
    OBSTACLE_APPROACH = "obstacle_approach"


class Latch(Enum):
    """Say when a cause stays in force after it has gone, until a person resets it."""

    ALWAYS = auto()
    ENERGISED = auto()
    NEVER = auto()


@dataclass(frozen=True, slots=True)
class CauseRule:
    """Describe one row; both counts are of control ticks.

    `debounce_samples` consecutive findings make the cause active. What does not latch ends
    `release_samples` clear ones after it was last active.
    """

    cause: Cause
    reaction: Reaction
    latch: Latch
    debounce_samples: int
    release_samples: int
    probe: Probe
    advice: str


# Rows of equal reaction are in order of precedence: the first one found is the one reported.
# Obstacles are debounced per scan, by the zones of the robot file; here a tick counts.
# fmt: off
RULES: tuple[CauseRule, ...] = (
    CauseRule(Cause.ESTOP,                   Reaction.GROUP_STOP,      Latch.ALWAYS,    1,   0,
         probes.estop, "release the button, then reset, then arm"),
    CauseRule(Cause.STANDSTILL_MOTION,       Reaction.GROUP_STOP,      Latch.ENERGISED, 50,  0,
         probes.standstill_motion, "something moved the robot while it had to stand: look for it"),
    CauseRule(Cause.SERVO_BUS_LOST,          Reaction.HOLD,            Latch.ENERGISED, 1,   0,
         probes.servo_bus_lost, "check the bus cable and the servo's power"),
    CauseRule(Cause.CAN_BUS_LOST,            Reaction.HOLD,            Latch.ENERGISED, 1,   0,
         probes.can_bus_lost, "check cable and power of the wheel drives, on CAN its termination"),
    CauseRule(Cause.SERVO_HARDWARE_ERROR,    Reaction.HOLD,            Latch.ENERGISED, 1,   0,
         probes.servo_hardware_error, "remove the load, let the servo cool, then reboot it"),
    CauseRule(Cause.DRIVE_FAULT,             Reaction.HOLD,            Latch.ENERGISED, 1,   0,
         probes.drive_fault, "look the code up in the drive's manual"),
    CauseRule(Cause.SERVO_WATCHDOG_TRIPPED,  Reaction.HOLD,            Latch.ENERGISED, 1,   0,
         probes.servo_watchdog_tripped, "control was silent on the bus: look at late_ticks"),
    CauseRule(Cause.JOINT_UNPOWERED,         Reaction.HOLD,            Latch.ENERGISED, 3,   0,
         probes.joint_unpowered, "the servo let go: support the arm, then look at its supply"),
    CauseRule(Cause.ENCODER_JUMP,            Reaction.HOLD,            Latch.ENERGISED, 1,   0,
         probes.encoder_jump, "disarm, then compare the joint's angle with the arm itself"),
    CauseRule(Cause.JOINT_POSITION_LIMIT,    Reaction.HOLD,            Latch.ENERGISED, 2,   0,
         probes.joint_position_limit, "disarm and move the joint back into its range"),
    CauseRule(Cause.JOINT_VELOCITY_LIMIT,    Reaction.HOLD,            Latch.ENERGISED, 5,   0,
         probes.joint_velocity_limit, "something drives the joint: look for a collision or a drop"),
    CauseRule(Cause.FOLLOWING_ERROR,         Reaction.HOLD,            Latch.ENERGISED, 50,  0,
         probes.following_error, "the joint is blocked or overloaded: disarm, then free it"),
    CauseRule(Cause.WHEEL_FOLLOWING_ERROR,   Reaction.BASE_OFF,        Latch.ENERGISED, 50,  0,
         probes.wheel_following_error, "look for a blocked wheel, then at its encoder's cable"),
    CauseRule(Cause.JOINT_CURRENT_LIMIT,     Reaction.HOLD,            Latch.ENERGISED, 250, 0,
         probes.joint_current_limit, "the joint is overloaded: disarm, then take the load off"),
    CauseRule(Cause.JOINT_TEMPERATURE_LIMIT, Reaction.HOLD,            Latch.ENERGISED, 25,  0,
         probes.joint_temperature_limit, "let the servo cool down, and give it less to hold"),
    CauseRule(Cause.COLLISION,               Reaction.HOLD,            Latch.ENERGISED, 15,  0,
         around.collision, "free whoever or whatever the arm has met"),
    CauseRule(Cause.SUPERVISOR_LOST,         Reaction.HOLD,            Latch.ENERGISED, 1,   0,
         probes.supervisor_lost, "start the supervisor"),
    CauseRule(Cause.JOINT_VOLTAGE_LIMIT,     Reaction.PROTECTIVE_STOP, Latch.NEVER,     25,  500,
         probes.joint_voltage_limit, "charge the battery, or check the supply"),
    CauseRule(Cause.SELF_COLLISION,          Reaction.PROTECTIVE_STOP, Latch.NEVER,     2,   125,
         around.self_collision, "move the parts away from each other"),
    CauseRule(Cause.ENVIRONMENT_COLLISION,   Reaction.PROTECTIVE_STOP, Latch.NEVER,     2,   125,
         around.environment_collision, "move the part away from what is there"),
    CauseRule(Cause.WORKSPACE,               Reaction.PROTECTIVE_STOP, Latch.NEVER,     2,   125,
         around.workspace, "bring it back into the workspace"),
    CauseRule(Cause.TIP_OVER,                Reaction.PROTECTIVE_STOP, Latch.NEVER,     3,   250,
         around.tip_over, "look at the floor, and bring the arms in"),
    CauseRule(Cause.BUDGET_EXHAUSTED,        Reaction.PROTECTIVE_STOP, Latch.NEVER,     1,   250,
         probes.budget_exhausted, "see: vla-deploy status"),
    CauseRule(Cause.STALE_SCAN,              Reaction.BASE_RAMP,       Latch.NEVER,     1,   125,
         around.stale_scan, "without its lidar the base does not drive: look at perception"),
    CauseRule(Cause.STALE_DEPTH,             Reaction.BASE_RAMP,       Latch.NEVER,     1,   125,
         around.stale_depth, "without its depth camera the base does not drive: see perception"),
    CauseRule(Cause.STALE_POSE,              Reaction.BASE_RAMP,       Latch.NEVER,     1,   125,
         around.stale_pose, "near keep-out areas the base must know its place: see perception"),
    CauseRule(Cause.STALE_IMU,               Reaction.BASE_RAMP,       Latch.NEVER,     1,   125,
         around.stale_imu, "without its IMU nobody knows whether it tips: look at perception"),
    CauseRule(Cause.STALE_COMMAND,           Reaction.BASE_RAMP,       Latch.NEVER,     1,   0,
         probes.stale_command, "the commanding process is silent"),
    CauseRule(Cause.KEEP_OUT_ZONE,           Reaction.BASE_BLOCK,      Latch.NEVER,     2,   25,
         around.keep_out, "drive out of the area"),
    CauseRule(Cause.OBSTACLE_STOP_ZONE,      Reaction.BASE_BLOCK,      Latch.NEVER,     1,   25,
         around.in_zone(ZoneKind.STOP), "clear the way, or drive the other way"),
    CauseRule(Cause.TIP_MARGIN,              Reaction.BASE_SLOW,       Latch.NEVER,     1,   25,
         around.tip_margin, "drive more gently there, and bring the arms in"),
    CauseRule(Cause.OBSTACLE_SLOW_ZONE,      Reaction.BASE_SLOW,       Latch.NEVER,     1,   25,
         around.in_zone(ZoneKind.SLOW), "clear the way"),
    CauseRule(Cause.OBSTACLE_LIMIT_ZONE,     Reaction.BASE_SLOW,       Latch.NEVER,     1,   25,
         around.in_zone(ZoneKind.LIMIT), "clear the way"),
    CauseRule(Cause.OBSTACLE_APPROACH,       Reaction.BASE_SLOW,       Latch.NEVER,     1,   25,
         around.in_zone(ZoneKind.APPROACH), "clear the way"),
)
# fmt: on
