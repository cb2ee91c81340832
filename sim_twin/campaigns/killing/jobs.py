"""List what people ask a robot for while its processes are killed."""

from dataclasses import dataclass
from typing import Final

from vla_deploy.robots import RobotDescription


@dataclass(frozen=True, slots=True, kw_only=True)
class Jobs:
    """Hold commands that ask for no answer, and what is said to a robot with a full hand.

    A kill may have left it with something; it may know no more than that there is something.
    """

    commands: tuple[str, ...]
    put_down: tuple[str, ...]


AT_HOME: Final = Jobs(
    commands=(
        "pick up the nearest red cup and put it on the coffee table",
        "pick up the nearest blue ball and put it on the coffee table",
        "pick up the nearest red cup and put it in the box",
        "pick up the nearest blue ball and put it on the coffee table",
    ),
    put_down=tuple(f"put down the thing in your {hand} hand" for hand in ("left", "right")),
)
"""All are picking and placing, most of it where the robot stands; the box is some metres away."""
ON_A_TABLE: Final = Jobs(
    commands=(
        "pick up the nearest red block and put it on the table",
        "pick up the nearest blue block and put it on the table",
    ),
    put_down=("put it down",),
)
ON_THE_FLOOR: Final = Jobs(
    commands=(
        "pick up the nearest red block and put it on the floor",
        "turn left by 30 degrees",
        "pick up the nearest blue block and put it on the floor",
        "turn right by 30 degrees",
    ),
    put_down=("put it down",),
)


def jobs_of(robot: RobotDescription) -> Jobs:
    """Return what a robot is asked for: in its home, on the table of its mount, or on the floor."""
    if robot.finds_its_way:
        return AT_HOME
    return ON_A_TABLE if robot.parts.base is None else ON_THE_FLOOR
