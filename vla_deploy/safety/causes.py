"""Declare which cause leads to which reaction: the one table of the safety rules.

A late tick is no cause of its own: the servos' Bus Watchdog and the drives' heartbeat judge
silence where it matters, and `servo_watchdog_tripped` brings the answer back.
"""

from dataclasses import dataclass
from enum import Enum, IntEnum

from vla_deploy.safety import probes
from vla_deploy.safety.probes import Probe


class Reaction(IntEnum):
    """Order what may be done about a cause, the most restrictive last.

    BASE_RAMP brings the base to rest and leaves the joints alone. HOLD is stop category 2
    everywhere: a controlled stop, power kept. BASE_OFF is HOLD for the joints, while the wheels
    brake by themselves and lose power, for they do not do as they are told. GROUP_STOP stops every
    joint group by the category that the robot file gives it.
    """

    NONE = 0
    BASE_RAMP = 1
    HOLD = 2
    BASE_OFF = 3
    GROUP_STOP = 4


class Cause(Enum):
    """Name everything that may stop the robot."""

    NONE = "none"
    ESTOP = "estop"
    SERVO_BUS_LOST = "servo_bus_lost"
    CAN_BUS_LOST = "can_bus_lost"
    SERVO_HARDWARE_ERROR = "servo_hardware_error"
    DRIVE_FAULT = "drive_fault"
    SERVO_WATCHDOG_TRIPPED = "servo_watchdog_tripped"
    JOINT_POSITION_LIMIT = "joint_position_limit"
    JOINT_VELOCITY_LIMIT = "joint_velocity_limit"
    FOLLOWING_ERROR = "following_error"
    WHEEL_FOLLOWING_ERROR = "wheel_following_error"
    SUPERVISOR_LOST = "supervisor_lost"
    STALE_COMMAND = "stale_command"


class Latch(Enum):
    """Say when a cause stays in force after it has gone, until a person resets it."""

    ALWAYS = "always"
    ENERGISED = "while energised"
    NEVER = "never"


class ResetBy(Enum):
    """Say who ends the reaction."""

    OPERATOR = "operator"
    AUTOMATIC = "automatic"


@dataclass(frozen=True, slots=True)
class Rule:
    """Describe one row: `debounce_samples` consecutive findings make the cause active."""

    cause: Cause
    reaction: Reaction
    latch: Latch
    debounce_samples: int
    probe: Probe
    advice: str

    @property
    def reset_by(self) -> ResetBy:
        """Tell who ends the reaction: what latches waits for a person."""
        return ResetBy.AUTOMATIC if self.latch is Latch.NEVER else ResetBy.OPERATOR


# Rows of equal reaction are in order of precedence: the first one found is the one reported.
# fmt: off
RULES: tuple[Rule, ...] = (
    Rule(Cause.ESTOP,                   Reaction.GROUP_STOP, Latch.ALWAYS,    1,
         probes.estop, "release the button, then reset, then arm"),
    Rule(Cause.SERVO_BUS_LOST,          Reaction.HOLD,       Latch.ENERGISED, 1,
         probes.servo_bus_lost, "check the bus cable and the servo's power"),
    Rule(Cause.CAN_BUS_LOST,            Reaction.HOLD,       Latch.ENERGISED, 1,
         probes.can_bus_lost, "check the CAN cable, its termination and the drive's power"),
    Rule(Cause.SERVO_HARDWARE_ERROR,    Reaction.HOLD,       Latch.ENERGISED, 1,
         probes.servo_hardware_error, "remove the load, let the servo cool, then reboot it"),
    Rule(Cause.DRIVE_FAULT,             Reaction.HOLD,       Latch.ENERGISED, 1,
         probes.drive_fault, "look the code up in the drive's manual"),
    Rule(Cause.SERVO_WATCHDOG_TRIPPED,  Reaction.HOLD,       Latch.ENERGISED, 1,
         probes.servo_watchdog_tripped, "control was silent on the bus: look at late_ticks"),
    Rule(Cause.JOINT_POSITION_LIMIT,    Reaction.HOLD,       Latch.ENERGISED, 2,
         probes.joint_position_limit, "disarm and move the joint back into its range"),
    Rule(Cause.JOINT_VELOCITY_LIMIT,    Reaction.HOLD,       Latch.ENERGISED, 5,
         probes.joint_velocity_limit, "something drives the joint: look for a collision or a drop"),
    Rule(Cause.FOLLOWING_ERROR,         Reaction.HOLD,       Latch.ENERGISED, 50,
         probes.following_error, "the joint is blocked or overloaded: disarm, then free it"),
    Rule(Cause.WHEEL_FOLLOWING_ERROR,   Reaction.BASE_OFF,   Latch.ENERGISED, 50,
         probes.wheel_following_error, "look for a blocked wheel, then at its encoder's cable"),
    Rule(Cause.SUPERVISOR_LOST,         Reaction.HOLD,       Latch.ENERGISED, 1,
         probes.supervisor_lost, "start the supervisor"),
    Rule(Cause.STALE_COMMAND,           Reaction.BASE_RAMP,  Latch.NEVER,     1,
         probes.stale_command, "the commanding process is silent"),
)
# fmt: on
