"""Say whether anything ends the torque of a robot's servos where its computer dies."""

from typing import Final

from drivers.servo.family import family_of
from vla_deploy.robots.description import RobotDescription

GUARD_REMEDY: Final = "[power_relay] of a board that falls without pulses, or a switch at hand"
GUARD_PAGE: Final = "docs/safety.md#servos-without-a-watchdog"


def unguarded_servos(robot: RobotDescription) -> str:
    """Return that the servos go on when the computer dies, "" where something ends that."""
    model, relay = robot.servo_bus.servos[0].model, robot.power_relay
    if robot.read_only or family_of(model).facts(model).has_watchdog:
        return ""
    if relay is None:
        lacks = "no relay is in their supply"
    elif relay.is_fail_safe:
        return ""
    else:
        lacks = f"the relay in their supply ({relay.model}) does not open by itself"
    return (
        f"{model} has no bus watchdog, and {lacks}: they keep their torque when the computer dies"
    )
