"""Keep the way of the base clear of what is not on the map: around it, or wait and say what it is.

What moves is waited for, and only then passed, at a distance.
"""

import itertools
import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from drivers.clock import NS_PER_S
from vla_deploy.navigation.errors import NoPath
from vla_deploy.robots.floor_pose import Points, Pose2D
from vla_deploy.skills.context import SkillContext, spoken
from vla_deploy.skills.link import LiveView

LOOK_M: Final = 2.5
"""As far along the way it is looked at: beyond, most will be seen better from nearer."""
STRIDE_M: Final = 0.05
ASIDE_M: Final = 0.08
"""More than the clearance of any path: cells and tracking are a little off."""
ASIDE_OF_MOVERS_M: Final = 0.35
WAIT_S: Final = 4.0
NEAR_MOVER_M: Final = 0.6
FORESEEN_S: Final = 1.5
NAMED_WITHIN_M: Final = 0.4


class Detour:
    """Watch the way to its end; `closed_by` says what there is no way around, "" while there is."""

    def __init__(self, context: SkillContext, way: Points) -> None:
        """Take the planned way, (n, 2) points of the map frame."""
        self.closed_by = ""
        self.way = way
        self._context = context
        self._stamp_ns = 0
        self._waits_since_ns: int | None = None

    def revise(self, pose: Pose2D) -> bool:
        """Look whether something stands in the way; return whether the way is another one now."""
        live = self._context.link.live_obstacles()
        if live is None or live.stamp_ns == self._stamp_ns:
            return False
        self._stamp_ns = live.stamp_ns
        ahead = _ahead(self.way, pose)
        blocking = live.points[_near(live.points, ahead, self._context.planner.radius_m)]
        moving = self._movers_near(live.movers, ahead, blocking)
        if not len(blocking) and not len(moving):
            self.closed_by, self._waits_since_ns = "", None
            return False
        if len(moving) and self._waits():
            self.closed_by = "somebody is in the way"
            return False
        return self._go_around(live, pose, blocking, moving[:, :2])

    def _waits(self) -> bool:
        now_ns = self._context.link.working_ns()
        self._waits_since_ns = self._waits_since_ns or now_ns
        return now_ns - self._waits_since_ns < WAIT_S * NS_PER_S

    def _go_around(self, live: LiveView, pose: Pose2D, blocking: Points, met: Points) -> bool:
        planner = self._context.planner.around(live.points, ASIDE_M)
        if len(live.movers):
            planner = planner.around(live.movers[:, :2], ASIDE_OF_MOVERS_M)
        goal = self.way[-1]
        try:
            way = planner.plan((pose.x_m, pose.y_m), (float(goal[0]), float(goal[1])))
        except NoPath:
            self.closed_by = f"the way is closed by {self._named(blocking, met)}"
            return False
        self.way, self.closed_by = way, ""
        return True

    def _movers_near(
        self, movers: NDArray[np.float64], ahead: Points, blocking: Points
    ) -> NDArray[np.float64]:
        """Return what moves on the way, soon will be, or just now left there what blocks it."""
        at, velocity = movers[:, :2], movers[:, 2:]
        reach_m = self._context.planner.radius_m + ASIDE_OF_MOVERS_M
        soon = at + FORESEEN_S * velocity
        met = _near(at, ahead, reach_m) | _near(soon, ahead, reach_m)
        return movers[met | _near(at, blocking, NEAR_MOVER_M)]

    def _named(self, blocking: Points, met: Points) -> str:
        if not len(blocking):  # then somebody is in it, or soon will be
            return f"somebody{self._place_near(met[0])}"
        link, middle = self._context.link, blocking.mean(axis=0)
        scene = link.snapshot()
        things = () if scene is None else scene.things
        known = [(math.dist(one.xy_m, middle), str(one)) for one in things]
        known += [(math.dist(one["position_m"], middle), one["class"]) for one in link.bystanders]
        away_m, name = min(known, default=(math.inf, ""))
        place = self._place_near(middle)
        return f"a {name}{place}" if away_m < NAMED_WITHIN_M else f"something{place}"

    def _place_near(self, at: Points) -> str:
        places = self._context.robot.places
        poses = {name: one.pose for name, one in places.items()}
        away_m = {name: math.hypot(p.x_m - at[0], p.y_m - at[1]) for name, p in poses.items()}
        if not away_m:
            return ""
        nearest = min(away_m, key=lambda name: away_m[name])
        return f", {away_m[nearest]:.1f} m from the {spoken(nearest)}"


def samples_of(way: Points) -> Points:
    """Return points along a way, STRIDE_M apart and its corners among them."""
    samples = [way[:1]]
    for first, second in itertools.pairwise(way):
        count = max(1, math.ceil(math.dist(first, second) / STRIDE_M))
        shares = np.arange(1, count + 1)[:, None] / count
        samples.append(first + shares * (second - first))
    return np.vstack(samples)


def _ahead(way: Points, pose: Pose2D) -> Points:
    """Return points on what is left of a way, from the nearest to the robot on, up to LOOK_M."""
    points = samples_of(way)
    nearest = int(np.argmin(np.hypot(*(points - (pose.x_m, pose.y_m)).T)))
    return points[nearest : nearest + round(LOOK_M / STRIDE_M)]


def _near(points: Points, others: Points, within_m: float) -> NDArray[np.bool_]:
    """Return which of (n, 2) points are within a distance of any of (m, 2) others."""
    if not len(points) or not len(others):
        return np.zeros(len(points), dtype=np.bool_)
    away_m = np.linalg.norm(points[:, None] - others[None], axis=2)
    near: NDArray[np.bool_] = (away_m < within_m).any(axis=1)
    return near
