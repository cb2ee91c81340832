"""Judge whether an arm keeps clear of the rest of the robot on a way between postures."""

from collections.abc import Sequence
from itertools import pairwise
from typing import Final

import numpy as np
from numpy.typing import NDArray

from vla_deploy.control.judging.body_shapes import BodyShapes
from vla_deploy.skills.context import SkillContext

Floats = NDArray[np.float64]

SPARE_M: Final = 0.004
"""More than where control would stop: joints trail behind their setpoints."""
STEP_RAD: Final = 0.15
"""Of the joint that moves farthest: the hand moves by less than 0.1 m."""


def is_clear_of_self(
    context: SkillContext, hand: str, way: Sequence[Floats], opening_m: float
) -> bool:
    """Return whether a way from posture to posture of the whole robot, the hand open, is free."""
    if context.shapes is None:
        context.shapes = BodyShapes(context.robot)
    robot = context.robot
    least_m = robot.protection.clearance.self_m + SPARE_M
    fingers = robot.joint_index[robot.gripper_joint(hand)]
    position = robot.hands[hand].position_at(opening_m)
    for posture in _along(way):
        posture[fingers] = position
        if float(context.shapes.survey(posture).self_m.min(initial=np.inf)) < least_m:
            return False
    return True


def _along(way: Sequence[Floats]) -> list[Floats]:
    """Return postures of a way, the last of each piece first: most that is not free ends so."""
    found = []
    for begin, end in pairwise(way):
        count = max(1, int(np.ceil(np.abs(end - begin).max() / STEP_RAD)))
        found += [begin + share * (end - begin) for share in np.linspace(1.0, 0.0, count + 1)[:-1]]
    return found
