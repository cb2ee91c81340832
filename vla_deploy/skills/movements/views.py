"""Choose from where to look at a thing, so that it is seen from two sides."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from vla_deploy.robots.floor_pose import Pose2D, wrap_angle
from vla_deploy.skills.context import SkillContext
from vla_deploy.skills.movements.stand import effort
from vla_deploy.skills.movements.whereabouts import room_at

APART_RAD: Final = math.radians(60.0)
DRIVEN_RAD: Final = 0.06
"""So far off the side is on which a drive ends: it ends within centimetres."""
DISTANCES_M: Final = (0.8, 1.0, 1.25)
"""From where everything on furniture is recognised, and the camera sees down to it."""
BEARINGS: Final = 36
FURNITURE_M: Final = 1.0
"""No more of the map is blocked between a thing on furniture and its edge."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ViewStand:
    """Hold where to stand, facing a thing, and from which side of it that is, in the map."""

    pose: Pose2D
    side_rad: float

    def apart_rad(self, other: "ViewStand") -> float:
        """Return the angle between two views, as seen from the thing."""
        return abs(wrap_angle(self.side_rad - other.side_rad))


def view_stands(context: SkillContext, position_m: Sequence[float]) -> list[ViewStand]:
    """Return free stands around a thing, in its room, from which no wall hides it."""
    x_m, y_m = float(position_m[0]), float(position_m[1])
    return [one for one in _around(x_m, y_m) if _sees(context, one.pose, (x_m, y_m))]


def next_view(
    context: SkillContext, stands: Sequence[ViewStand], first: ViewStand | None
) -> ViewStand:
    """Return the stand to go to: one of the pair of least driving that is far enough apart.

    After the `first` view, its best partner; where none is far enough apart, what is farthest.
    """
    here = context.link.pose
    begins = stands if first is None else (first,)
    pairs = [(a, b) for a in begins for b in stands]
    wide = [(a, b) for a, b in pairs if a.apart_rad(b) >= APART_RAD + DRIVEN_RAD]
    if wide:
        a, b = min(wide, key=lambda pair: effort(here, pair[0].pose) + effort(*_poses(pair)))
    else:
        a, b = max(pairs, key=lambda pair: pair[0].apart_rad(pair[1]))
    return a if first is None else b


def _poses(pair: tuple[ViewStand, ViewStand]) -> tuple[Pose2D, Pose2D]:
    return pair[0].pose, pair[1].pose


def _around(x_m: float, y_m: float) -> Iterator[ViewStand]:
    for step in range(BEARINGS):
        side_rad = wrap_angle(2.0 * math.pi * step / BEARINGS)
        for away_m in DISTANCES_M:
            at = (x_m + away_m * math.cos(side_rad), y_m + away_m * math.sin(side_rad))
            yield ViewStand(pose=Pose2D(*at, wrap_angle(side_rad + math.pi)), side_rad=side_rad)


def _sees(context: SkillContext, pose: Pose2D, at: tuple[float, float]) -> bool:
    """Return whether one may stand there, and nothing but what the thing stands on is between."""
    planner = context.planner
    if not planner.is_free(pose.x_m, pose.y_m):
        return False
    if room_at(context, pose.x_m, pose.y_m) != room_at(context, *at):
        return False
    grid = planner.grid
    count = math.ceil(2.0 * math.dist((pose.x_m, pose.y_m), at) / grid.resolution_m)
    line = np.linspace((pose.x_m, pose.y_m), at, count)
    blocked = np.array([grid.blocked[grid.world_to_cell(*point)] for point in line.tolist()])
    first = int(np.argmax(blocked)) if blocked.any() else count - 1
    is_one_piece = blocked[first:-1].all()
    return bool(is_one_piece and math.dist(line[first], at) < FURNITURE_M)
