"""Say how a robot moves in each phase of its work: what it carries, and where it reaches."""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from typing import Final

from vla_deploy.robots import RobotDescription


class Phase(Enum):
    """Name what the robot does when something fails."""

    IDLE = "idle"
    DRIVING = "driving"
    REACHING = "reaching"
    CARRYING = "carrying"


@dataclass(frozen=True, slots=True, kw_only=True)
class Choreography:
    """Hold where joints go: with the hand before the body to take the `payload`, and from there.

    The payload's middle is between the fingers of `hand`. `servos` are those that fail alone.
    """

    payload: str
    hand: str
    hold: Mapping[str, float]
    reach: Mapping[str, float]
    carry_reach: Mapping[str, float]
    servos: tuple[str, ...]
    phases: tuple[Phase, ...] = tuple(Phase)


_BUTLERS: Final = Choreography(
    payload="red_cup",
    hand="left",
    hold={
        "left_shoulder_yaw": -0.4,
        "left_shoulder_pitch": -0.3,
        "left_elbow": 2.5,
        "left_wrist_pitch": -2.35,
        "left_wrist_roll": 1.57,
        "right_shoulder_yaw": 0.2,
    },
    reach={"left_elbow": 1.9, "left_shoulder_pitch": 0.4, "right_elbow": 1.9},
    carry_reach={"left_elbow": 2.2, "right_elbow": 2.2},
    servos=("left_elbow", "left_gripper"),
)
"""Its left hand before the chest, where its fingers hold the cup from both sides."""


def choreography_of(robot: RobotDescription) -> Choreography:
    """Return that of a robot: Butler's, or that of an arm with its usual poses.

    An arm on a base that does not find its way stands still; a wheel's servo fails under it, too.
    """
    if robot.finds_its_way:
        return _BUTLERS
    hand = next(iter(robot.hands))
    joints, gripper = robot.group(robot.hands[hand].arm).joints, robot.gripper_joint(hand)
    ready, aside = ({name: robot.poses[one][name] for name in joints} for one in ("ready", "aside"))
    return Choreography(
        payload="red_block",
        hand=hand,
        hold=ready,
        reach=ready,
        carry_reach=aside,
        servos=(joints[2], gripper, *(one.joint for one in robot.servo_bus.wheels[:1])),
        phases=(Phase.IDLE, Phase.REACHING, Phase.CARRYING),
    )
