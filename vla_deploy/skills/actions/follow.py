"""Follow somebody who walks: stay behind at a distance, as long as lidar and camera see them."""

import itertools
import math
from collections import deque
from collections.abc import Iterator, Mapping
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from drivers.clock import NS_PER_S
from vla_deploy.navigation.errors import NoPath
from vla_deploy.navigation.follower import AT_REST, PathFollower, Twist
from vla_deploy.robots.floor_pose import Points, Pose2D, wrap_angle
from vla_deploy.skills.context import Skill, SkillContext
from vla_deploy.skills.errors import NotPossible, TryAgain
from vla_deploy.skills.movements.bearings import find_myself
from vla_deploy.skills.movements.carrying import carry
from vla_deploy.skills.movements.detour import ASIDE_M, samples_of
from vla_deploy.skills.movements.drive import (
    Patience,
    base_of,
    drive_to,
    hindrance_of,
    limits_of,
)
from vla_deploy.skills.movements.gaze import DRIVING_GAZE, turn_head

DISTANCE_M: Final = 0.95
"""Where it stands behind somebody who stands; at a walk it is a braking distance further back."""
FOUND_WITHIN_M: Final = 3.0
FIND_S: Final = 10.0
SAME_M: Final = 0.6
"""So far somebody gets from one scan to the next, as the lidar sees legs."""
STEPS: Final = 30
"""Scans, in three seconds; the camera may remember them a little longer where they were."""
LOST_S: Final = 1.5
BODY_M: Final = 0.45
"""What is this near to the middle of somebody belongs to them."""
NEAR_M: Final = 0.1
SOON_S: Final = 0.5
"""A way that is planned now leads there, past the delay of the base."""
LONGEST_S: Final = 1800.0
PLAN_EVERY_NS: Final = 3 * NS_PER_S // 10
FACING_RAD: Final = 0.2
TURN_GAIN_1_S: Final = 1.5
ROOM_M: Final = 0.9
"""Who comes nearer is made room for."""
AROUND_M: Final = 0.4
"""A way that is so much longer than the straight line leads around something."""
BACKING_M_S: Final = 0.25
BACKING_REACH_M: Final = 0.3
BACKING_RAD: Final = 0.8
CAME_BY: Final = 5
"""So many of the places where they were are tried, of the last three seconds."""
WALK: Final = "I do not see you. Walk a little, so that I know whom to follow."
LOST: Final = "I have lost you. Come back to me, or tell me something else."


def follow_person(context: SkillContext, parameters: Mapping[str, Any]) -> Skill:
    """Follow the nearest person who moves, for `duration_s`, or until told to stop.

    Raises:
        TryAgain: nobody is seen to move nearby, or who was followed is out of sight.
        NotPossible: the robot has no base.
    """
    base_of(context)
    yield from carry(context)
    yield from turn_head(context, *DRIVING_GAZE)
    yield from find_myself(context)
    whom, link = _Followed(context), context.link
    for_s = float(parameters.get("duration_s", LONGEST_S))
    end_ns = link.working_ns() + round(for_s * NS_PER_S)
    yield from _find(context, whom, WALK, "nobody walks near me whom I could follow")
    behind = _Behind(context, whom)
    while link.working_ns() < end_ns:
        if whom.is_lost():
            yield from _go_after(context, whom)
            where = f"{whom.seen_at[0]:.1f}, {whom.seen_at[1]:.1f} m"
            yield from _find(context, whom, LOST, f"I lost whom I followed, at {where}")
        link.drive(behind.step())
        yield
    link.drive(AT_REST)


def _go_after(context: SkillContext, whom: "_Followed") -> Skill:
    """Drive to where they were seen last, until somebody is seen to walk from there."""
    goal = Pose2D(x_m=float(whom.seen_at[0]), y_m=float(whom.seen_at[1]), yaw_rad=0.0)
    try:
        yield from drive_to(
            context, goal, turn=False, until=lambda: not whom.is_lost() or whom.choose()
        )
    except (NotPossible, TryAgain) as error:
        context.note(f"cannot look where I saw you last: {error}")
        context.link.drive(AT_REST)


def _find(context: SkillContext, whom: "_Followed", ask: str, failure: str) -> Skill:
    """Wait until somebody moves nearby; ask for it where nobody does yet.

    Raises:
        TryAgain: nobody did.
    """
    end_ns = context.link.working_ns() + round(FIND_S * NS_PER_S)
    has_asked = False
    while not whom.choose():
        if not has_asked:
            context.say(ask)
            if not context.voice.why_silent():
                context.voice.say(ask)
            has_asked = True
        if context.link.working_ns() > end_ns:
            raise TryAgain(failure)
        context.link.drive(AT_REST)
        yield


class _Followed:
    """Know where who is followed is, by what perception sees beside the map."""

    def __init__(self, context: SkillContext) -> None:
        self.at: Points = np.zeros(2)
        self.seen_at: Points = np.zeros(2)
        self.others: Points = np.zeros((0, 2))
        """What else is not on the map: nothing where they have just been."""
        self._been: deque[Points] = deque(maxlen=STEPS)
        self._link = context.link
        self._velocity: Points = np.zeros(2)
        self._stamp_ns = 0
        self._seen_ns = 0

    def choose(self) -> bool:
        """Take the nearest who moves; return whether there is one."""
        live, pose = self._link.live_obstacles(), self._link.pose
        if live is None or not len(live.movers):
            return False
        away_m = np.hypot(*(live.movers[:, :2] - (pose.x_m, pose.y_m)).T)
        nearest = int(np.argmin(away_m))
        if away_m[nearest] > FOUND_WITHIN_M:
            return False
        self._stamp_ns = live.stamp_ns
        self._see(live.movers[nearest, :2], live.movers[nearest, 2:])
        return True

    def soon(self) -> Points:
        """Return where they will be in SOON_S."""
        ahead: Points = self.at + SOON_S * self._velocity
        return ahead

    def came_by(self) -> Iterator[Points]:
        """Yield where they are and where they were, the latest first."""
        yield self.at
        every = STEPS // CAME_BY
        yield from itertools.islice(reversed(self._been), every, None, every)

    def is_lost(self) -> bool:
        """Return whether they have been out of sight for too long, after a new look."""
        live = self._link.live_obstacles()
        if live is not None and live.stamp_ns != self._stamp_ns:
            self._look(live.points, live.movers, live.stamp_ns)
        return self._link.clock.now_ns() - self._seen_ns > LOST_S * NS_PER_S

    def _look(self, points: Points, movers: NDArray[np.float64], stamp_ns: int) -> None:
        gap_s = (stamp_ns - self._stamp_ns) / NS_PER_S
        self._stamp_ns = stamp_ns
        expected = self.at + self._velocity * gap_s
        moving_m = np.hypot(*(movers[:, :2] - expected).T)
        standing = points[np.hypot(*(points - self.at).T) < BODY_M]
        if len(movers) and moving_m.min() < SAME_M:
            nearest = int(np.argmin(moving_m))
            self._see(movers[nearest, :2], movers[nearest, 2:])
        elif len(standing):
            self._see(standing.mean(axis=0), np.zeros(2))
        else:
            self.at = expected
        self._been.append(self.at)
        away_m = np.linalg.norm(points[:, None] - np.array(self._been)[None], axis=2)
        self.others = points[(away_m >= BODY_M).all(axis=1)]

    def _see(self, at: Points, velocity: Points) -> None:
        self.at = self.seen_at = at
        self._velocity, self._seen_ns = velocity, self._stamp_ns


class _Behind:
    """Drive so as to stay behind: towards where they are, up to a distance, and facing them."""

    def __init__(self, context: SkillContext, whom: _Followed) -> None:
        self._context = context
        self._whom = whom
        self._limits = limits_of(context)
        self._patience = Patience(context)
        self._follower: PathFollower | None = None
        self._planned_ns = 0
        self._is_round_a_corner = False

    def step(self) -> Twist:
        """Return what to drive now.

        Raises:
            TryAgain: something has been in the way for too long.
        """
        pose, at = self._context.link.pose, self._whom.at
        away_m = math.dist((pose.x_m, pose.y_m), at)
        now_ns = self._context.link.working_ns()
        if now_ns - self._planned_ns > PLAN_EVERY_NS:
            self._planned_ns = now_ns
            self._revise(pose)
        if self._follower is None or (away_m < DISTANCE_M and not self._is_round_a_corner):
            return self._patience.pass_on(self._facing(pose, away_m), "")
        twist = self._follower.step(pose.x_m, pose.y_m, pose.yaw_rad)
        hindrance = hindrance_of(self._context, twist, max(away_m - BODY_M, 0.0))
        return self._patience.pass_on(twist, hindrance)

    def _revise(self, pose: Pose2D) -> None:
        """Plan the way anew, up to a distance before them; none where they are near."""
        here, soon = (pose.x_m, pose.y_m), self._whom.soon()
        way = self._way_to_them(here)
        left_m = np.cumsum(np.hypot(*np.diff(way, axis=0).T)[::-1])[::-1]
        away_m = math.dist(here, soon)
        self._is_round_a_corner = bool(len(left_m)) and left_m[0] - away_m > AROUND_M
        before = way[:-1][left_m >= DISTANCE_M]
        is_near = away_m < DISTANCE_M + NEAR_M and not self._is_round_a_corner
        if is_near or not len(before):
            self._follower = None
        elif self._follower is None:
            self._follower = PathFollower(before, self._limits)
        else:
            self._follower.take_up(before)

    def _way_to_them(self, here: tuple[float, float]) -> Points:
        """Return points of a way to where they soon are; (0, 2) where none leads there.

        Where they walk along furniture no way of ours leads to them, but one to where they came by.
        """
        planner = self._context.planner.around(self._whom.others, ASIDE_M)
        for goal in (self._whom.soon(), *self._whom.came_by()):
            try:
                return samples_of(planner.plan(here, (float(goal[0]), float(goal[1]))))
            except NoPath:
                continue
        return np.zeros((0, 2))

    def _facing(self, pose: Pose2D, away_m: float) -> Twist:
        """Turn to them, and make room for who comes too near, where there is some behind."""
        at = self._whom.soon()
        error_rad = wrap_angle(math.atan2(at[1] - pose.y_m, at[0] - pose.x_m) - pose.yaw_rad)
        most = self._limits.turn_rate_rad_s
        turn_rad_s = max(-most, min(most, TURN_GAIN_1_S * error_rad))
        if away_m < ROOM_M and abs(error_rad) < BACKING_RAD:
            back = Twist(-BACKING_M_S, turn_rad_s)
            if not hindrance_of(self._context, back, BACKING_REACH_M, planned=False):
                return back
        return AT_REST if abs(error_rad) < FACING_RAD else Twist(0.0, turn_rad_s)
