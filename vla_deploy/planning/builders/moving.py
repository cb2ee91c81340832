"""Build the steps of going straight and turning on the spot, by amounts and parts of a turn."""

import math
from typing import Final

from vla_deploy.planning.builders.steps import Groups, Step, quantity_in, speed_in
from vla_deploy.planning.interfaces import Request

DRIVE_M: Final = 0.5
TURN_RAD: Final = math.pi / 2
LITTLE_M: Final = 0.2
LITTLE_RAD: Final = math.radians(20.0)


def drive(groups: Groups, request: Request) -> list[Step]:
    """Drive straight."""
    sign = -1.0 if groups["way"].startswith(("back", "reverse")) else 1.0
    default = LITTLE_M if "little" in groups else DRIVE_M
    distance_m = sign * quantity_in(groups, "m", default)
    return [("move", {"distance_m": distance_m, **speed_in(groups, request)})]


def turn(groups: Groups, _: Request) -> list[Step]:
    """Turn on the spot."""
    way = groups.get("way", "around")
    default = math.pi if way in ("around", "round") else TURN_RAD
    default = LITTLE_RAD if "little" in groups else default
    sign = -1.0 if way in ("right", "clockwise") else 1.0
    return [("turn", {"angle_rad": sign * quantity_in(groups, "rad", default)})]


def turn_whole(_: Groups, __: Request) -> list[Step]:
    """Turn all the way round."""
    return [("turn", {"angle_rad": math.tau})]
