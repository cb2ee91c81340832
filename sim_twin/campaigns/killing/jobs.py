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


def jobs_of(robot: RobotDescription) -> Jobs:
    """Return what a robot is asked for: in its home, or on the table that it is mounted on."""
    return ON_A_TABLE if robot.parts.base is None else AT_HOME
