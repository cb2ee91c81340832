"""Guard a place: stand there, and report each person who comes in, once, aloud and as data."""

import math
from collections.abc import Mapping
from typing import Any, Final

from drivers.clock import NS_PER_S
from vla_deploy.navigation.follower import AT_REST
from vla_deploy.navigation.obstacles.arrivals import Arrivals
from vla_deploy.robots.floor_pose import Pose2D
from vla_deploy.skills.actions.navigate import pose_of_place
from vla_deploy.skills.context import Skill, SkillContext
from vla_deploy.skills.movements.bearings import find_myself
from vla_deploy.skills.movements.carrying import carry
from vla_deploy.skills.movements.drive import Patience, base_of, drive_to, stand_still
from vla_deploy.skills.movements.gaze import DRIVING_GAZE, turn_head
from vla_deploy.skills.movements.whereabouts import where_words

LONGEST_S: Final = 1800.0
SETTLE_S: Final = 1.0
"""What the lidar saw while the robot turned is a little off; then the scans agree."""
MOST_TOLD: Final = 50
SIDES: Final = ("ahead of me", "on my left", "behind me", "on my right")


def guard(context: SkillContext, parameters: Mapping[str, Any]) -> Skill:
    """Stand at `place`, or here, for `duration_s`, or until told to stop; report who comes in.

    Raises:
        TryAgain: the lidar has told nothing for too long, or the way to the place is blocked.
        NotPossible: the robot has no base, or no path leads there.
    """
    base_of(context)
    yield from carry(context)
    yield from turn_head(context, *DRIVING_GAZE)
    yield from find_myself(context)
    if "place" in parameters:
        yield from drive_to(context, pose_of_place(context, str(parameters["place"])))
    yield from stand_still(context, SETTLE_S)
    log = _Log(context)
    for_s = min(float(parameters.get("duration_s", LONGEST_S)), LONGEST_S)
    end_ns = context.link.working_ns() + round(for_s * NS_PER_S)
    patience, arrivals, stamp_ns = Patience(context), None, 0
    while context.link.working_ns() < end_ns:
        context.link.drive(AT_REST)
        live = context.link.live_obstacles()
        patience.bear("" if live is not None else "perception tells nothing of what moves here")
        if live is not None and live.stamp_ns != stamp_ns:
            arrivals, stamp_ns = arrivals or Arrivals(live.points), live.stamp_ns
            for at in arrivals.see(live.points, live.movers, live.stamp_ns):
                log.report(*at)
        yield


class _Log:
    """Say who has come in, and keep it as data of the action."""

    def __init__(self, context: SkillContext) -> None:
        self._context = context
        self._begun_ns = context.link.working_ns()
        self._told: list[dict[str, Any]] = []
        self._count = 0
        self._sum_up()

    def report(self, x_m: float, y_m: float) -> None:
        """Report somebody at a point of the map."""
        where = where_words(self._context, x_m, y_m)
        after_s = (self._context.link.working_ns() - self._begun_ns) / NS_PER_S
        entry = {"x_m": round(x_m, 2), "y_m": round(y_m, 2), "where": where}
        self._told = [*self._told, entry | {"after_s": round(after_s, 1)}][-MOST_TOLD:]
        self._count += 1
        self._sum_up()
        parts = ("Somebody has come in", side_words(self._context.link.pose, x_m, y_m), where)
        text = f"{', '.join(filter(None, parts))}."
        self._context.say(text)
        if not self._context.voice.why_silent():
            self._context.voice.say(text)

    def _sum_up(self) -> None:
        self._context.tell(came_in=self._count, people=self._told)
        who = {0: "nobody", 1: "one person"}.get(self._count, f"{self._count} people")
        self._context.note(f"{who} came in")


def side_words(pose: Pose2D, x_m: float, y_m: float) -> str:
    """Return how far from the robot a point is, and on which side: "2.1 metres ahead of me"."""
    ahead_m, left_m = pose.local((x_m, y_m))
    quarter = round(math.atan2(left_m, ahead_m) / (math.pi / 2)) % 4
    return f"{math.hypot(ahead_m, left_m):.1f} metres {SIDES[quarter]}"
