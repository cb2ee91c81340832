"""Say which parts of the robot an action needs, and how much of each there is."""

from typing import Final

from vla_deploy.plans.catalogue import NAVIGATION_TIMEOUT_S, SKILLS
from vla_deploy.plans.knowledge import match_device, spoken_devices
from vla_deploy.plans.plan import Action
from vla_deploy.robots import RobotDescription

ARMS: Final = "arms"
ONE_ARM: Final = "arm"
DEVICE: Final = "device"
CAMERA: Final = "camera"
SPEAKER: Final = "speaker"
"""Who has no speaker shows what it would say."""
# Whoever waits longer than the longest skill takes waits for something that will not end.
WAIT_LIMIT_S: Final = NAVIGATION_TIMEOUT_S


def body_of(robot: RobotDescription) -> dict[str, int]:
    """Return what one action at a time may use: the robot's groups, its senses, its devices."""
    devices = (f"{DEVICE} {name}" for name in robot.devices)
    senses = [SPEAKER] if robot.parts.camera is None else [CAMERA, SPEAKER]
    return dict.fromkeys((*robot.groups, *senses, *devices), 1)


def needs_of(action: Action, robot: RobotDescription) -> dict[str, int]:
    """Return what an action needs, by the catalogue.

    "arm" is the chosen one, or all of them; "device" is the one that the action names. Parts that
    a robot may lack are needed where it has them.
    """
    needed: dict[str, int] = {}
    spec = SKILLS[action.skill]
    for resource in spec.resources:
        if resource in robot.groups or resource not in spec.may_lack:
            needed |= dict.fromkeys(_parts(resource, action, robot), 1)
    posed = robot.poses.get(str(action.parameters.get("pose")), {})
    chosen = action.parameters.get("arm") is None
    return needed | dict.fromkeys(robot.groups_moving(posed) if chosen else (), 1)


def _parts(resource: str, action: Action, robot: RobotDescription) -> tuple[str, ...]:
    if resource == DEVICE:
        named = match_device(action.parameters.get("device"), spoken_devices(robot))
        return (f"{DEVICE} {named}",) if named is not None else ()
    if resource not in (ARMS, ONE_ARM):
        return (resource,)
    chosen = action.parameters.get("arm") if resource == ONE_ARM else None
    return tuple(
        group
        for name, hand in robot.hands.items()
        if chosen in (None, name)
        for group in (hand.arm, *robot.groups_moving((hand.gripper,)))
    )
