"""Drive through the flat on the lock-step twin, and judge by what MuJoCo knows.

drives/SEED      a fresh start, three rooms after another: nothing may hold the robot on the way
around/SEED      the same with a chair in each way that is not on the map and leaves room
passing/SEED     the same while somebody walks through the way
following/SEED   "follow me" for a minute of walking through the rooms
sweeping/ROOM    "vacuum the ..." of each place that has a floor
guard/SEED       "guard the ..." of a room: nobody, then somebody comes in, goes, and comes again
inspect/SEED     "inspect the ..." of a thing: from two sides, as physics has thing and robot
"""

import argparse
import math
import random
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from statistics import mean
from typing import Any, Final

import mujoco
import numpy as np
from numpy.typing import NDArray

from drivers.clock import NS_PER_S, MonotonicClock
from sim_twin.campaigns.evidence import Watch, unwatched
from sim_twin.campaigns.processes import played
from sim_twin.campaigns.report import CampaignCase, CampaignReport, crash_is_failure
from sim_twin.campaigns.selection import chosen
from sim_twin.harness.lockstep_stack import LockstepStack, armed_lockstep
from vla_deploy.navigation.errors import NoPath
from vla_deploy.navigation.path_planning import PathPlanner, base_planner
from vla_deploy.robots import load_robot
from vla_deploy.skills.context import spoken

COUNT: Final = 3
ROOMS: Final = ("kitchen", "bedroom", "living_room")
NEAREST_M: Final = 0.1
"""Somebody is never nearer to the robot's base than that while it drives."""
BESIDE_M: Final = (0.8, 1.6)
FOLLOWED_SHARE: Final = 0.95
COVERED: Final = 0.95
WALK_M_S: Final = 0.7
BEGINS_M: Final = 1.2
"""Nobody appears out of nothing nearer to the robot."""
STROLL_M_S: Final = 0.35
"""The base does 0.45 m/s at most."""
CHAIR_HALF_M: Final = 0.2
LEAVES_M: Final = 0.1
TOLD_WITHIN_S: Final = 3.0
"""Somebody is reported before they have been in view for longer."""
IN_VIEW_M: Final = 3.5
"""As far as perception trusts what the lidar shows beside the map."""
QUIET_S: Final = 10.0
GONE_S: Final = 8.0
COMES_M: Final = 5.0
"""So long is the way on which somebody comes in."""
APART_RAD: Final = math.radians(60.0)
SEEN_WITHIN_M: Final = 0.05
_LOOK_S: Final = 0.1
_LIMIT_S: Final = 120.0
_SWEEP_LIMIT_S: Final = 900.0
_FAR_M: Final = 2.0
_Points = NDArray[np.float64]


@dataclass(slots=True)
class _Notes:
    """Hold what was wrong, and the figures of a case."""

    failures: list[str] = field(default_factory=list)
    figures: dict[str, Any] = field(default_factory=dict)
    touches: int = 0

    def touched(self, way: str = "") -> None:
        """Note that the robot touched what stands fast."""
        self.touches += 1
        self.failures.append(f"touched something{way}")


def run(options: argparse.Namespace, tell: Callable[[str], None]) -> CampaignReport:
    """Play every case, several at a time; `options.count` seeds, 3 unless given."""
    seeds = range(options.seed, options.seed + (COUNT if options.count is None else options.count))
    kinds = ("drives", "around", "passing", "following", "guard", "inspect")
    names = [f"{kind}/{seed}" for kind in kinds for seed in seeds]
    places = load_robot("butler").places
    names += [f"sweeping/{name}" for name, place in places.items() if place.floor_m]
    cases = played(play, chosen(names, options.only, str), options.workers, tell, 1)
    return CampaignReport(campaign="navigation", cases=cases, summary=_summary(cases))


@crash_is_failure
def play(name: str, watch: Watch = unwatched) -> CampaignCase:
    """Play the case of that name."""
    kind, _, which = name.partition("/")
    clock = MonotonicClock()
    begun_ns, notes = clock.now_ns(), _Notes()
    with _robot(int(which) if which.isdigit() else 0) as course:
        watch(course.stack)
        match kind:
            case "following":
                _follow(course, notes)
            case "sweeping":
                _sweep(course, which, notes)
            case "guard":
                _guard(course, notes)
            case "inspect":
                _inspect(course, notes)
            case _:
                _drive(course, kind, notes)
    return CampaignCase(
        name=name,
        failures=tuple(notes.failures),
        figures=notes.figures | {"touches": notes.touches},
        seconds=(clock.now_ns() - begun_ns) / NS_PER_S,
    )


def _summary(cases: tuple[CampaignCase, ...]) -> dict[str, Any]:
    shares = {
        name: [one.figures[name] for one in cases if one.figures.get(name) is not None]
        for name in (
            "path_efficiency",
            "covered",
            "share_beside",
            "nearest_m",
            "held",
            "told_after_s",
        )
    }
    told = {f"mean {name}": round(mean(all_of), 3) for name, all_of in shares.items() if all_of}
    done = sum(not case.failures for case in cases)
    return {"success_rate": round(done / len(cases), 3) if cases else None} | told


class _Course:
    """Know the robot, the map and how near things are."""

    def __init__(self, stack: LockstepStack, seed: int) -> None:
        self.stack = stack
        self.planner: PathPlanner = base_planner(stack.robot)
        self.person = stack.lockstep.twin.person
        self.random = random.Random(seed)
        self._engine = stack.lockstep.twin.engine
        self._ours = self._solid("base")
        self._theirs = {name: self._solid(name) for name in ("chair", "person")}
        self._world = [
            geom
            for geom in np.flatnonzero(self._engine.model.geom_contype != 0).tolist()
            if self._engine.model.body_weldid[self._engine.model.geom_bodyid[geom]] == 0
            and self._engine.model.geom_type[geom] != mujoco.mjtGeom.mjGEOM_PLANE
        ]

    @property
    def at(self) -> tuple[float, float]:
        """Return where the base is."""
        robot = self.stack.lockstep.truth()["robot"]
        return robot["x_m"], robot["y_m"]

    def gap_m(self, name: str) -> float:
        """Return how far the robot is from a body, _FAR_M at most."""
        model, data, line = self._engine.model, self._engine.data, np.zeros(6)
        pairs = ((ours, theirs) for ours in self._ours for theirs in self._theirs[name])
        return min(
            float(mujoco.mj_geomDistance(model, data, *pair, _FAR_M, line)) for pair in pairs
        )

    def is_in_view(self) -> bool:
        """Return whether nothing is between the lidar and somebody who is near enough to it."""
        model, data, at_m = self._engine.model, self._engine.data, self.person.document()["at_m"]
        lidar = data.site(self.stack.robot.lidar.site).xpos
        if at_m is None or math.dist(at_m, lidar[:2]) > IN_VIEW_M:
            return False
        begin, hit = np.array((*at_m, lidar[2])), np.array((-1,), dtype=np.int32)
        them = model.body("person").id
        mujoco.mj_ray(model, data, begin, lidar - begin, None, 1, them, hit, None)
        body = model.geom_bodyid[hit[0]] if hit[0] >= 0 else 0
        return bool(model.body_rootid[body] == model.body_rootid[model.body("base").id])

    def touches(self) -> bool:
        """Return whether a part of the robot touches what stands fast."""
        contacts = self._engine.data.contact.geom
        ours, fixed = set(self._ours), {*self._world, *self._theirs["chair"]}
        return any((a in ours and b in fixed) or (b in ours and a in fixed) for a, b in contacts)

    def _solid(self, body: str) -> list[int]:
        model = self._engine.model
        root = model.body_rootid[model.body(body).id]
        same = model.body_rootid[model.geom_bodyid] == root
        return [int(one) for one in np.flatnonzero(same & (model.geom_contype != 0))]


@contextmanager
def _robot(seed: int) -> Iterator[_Course]:
    with (
        tempfile.TemporaryDirectory(prefix="vla-") as folder,
        armed_lockstep(Path(folder), seed=seed) as stack,
    ):
        yield _Course(stack, seed)


def _drive(course: _Course, kind: str, notes: _Notes) -> None:
    """Drive from room to room; a way in which nothing can be put is driven as it is."""
    shortest_m, driven_m, held, nearest_m = 0.0, 0.0, 0, _FAR_M
    for room in ROOMS:
        goal = course.stack.robot.places[room].pose
        way = course.planner.plan(course.at, (goal.x_m, goal.y_m))
        shortest_m += _length_m(way)
        if kind == "around":
            _put_chair(course, way)
        elif kind == "passing":
            _cross(course, way)
        command_id, cause, before = course.stack.give(text=f"go to the {spoken(room)}"), "", None
        end_s = course.stack.lockstep.now_s + _LIMIT_S
        while (outcome := course.stack.outcome(command_id)) is None:
            if course.stack.lockstep.now_s > end_s:
                break
            course.stack.lockstep.run_for(_LOOK_S)
            driven_m += math.dist(course.at, before or course.at)
            before = course.at
            nearest_m = min(nearest_m, *map(course.gap_m, ("chair", "person")))
            now = str(course.stack.status().get("cause", ""))
            held += now != cause and "stop_zone" in now
            cause = now
            if course.touches():
                notes.touched(f" on the way to the {spoken(room)}")
                break
        if not (outcome or {}).get("success"):
            notes.failures.append(f"{room}: {(outcome or {}).get('error') or 'no end in time'}")
        if "chair" not in course.person.document()["taken"]:
            course.person.take("chair")
    if kind == "drives" and held:
        notes.failures.append(f"held {held} times with nothing in the way")
    if kind == "passing" and nearest_m < NEAREST_M:
        notes.failures.append(f"somebody was {nearest_m:.2f} m near, expected {NEAREST_M}")
    notes.figures |= {"path_efficiency": round(shortest_m / max(driven_m, shortest_m), 3)}
    notes.figures |= {"held": held}
    notes.figures |= {} if kind == "drives" else {"nearest_m": round(nearest_m, 3)}


def _put_chair(course: _Course, way: _Points) -> None:
    """Put the chair somewhere in the middle of a way, where it leaves another."""
    spots = _spots(way)
    course.random.shuffle(spots)
    grid = np.linspace(-CHAIR_HALF_M, CHAIR_HALF_M, 9)
    seat = np.array([(x_m, y_m) for x_m in grid for y_m in grid])
    for x_m, y_m in spots:
        yaw_rad = course.random.uniform(-math.pi, math.pi)
        c, s = math.cos(yaw_rad), math.sin(yaw_rad)
        covered = seat @ np.array(((c, s), (-s, c))) + (x_m, y_m)
        try:
            course.planner.around(covered, LEAVES_M).plan(course.at, tuple(way[-1].tolist()))
        except NoPath:
            continue
        course.person.put("chair", {"x_m": x_m, "y_m": y_m, "z_m": 0.0, "yaw_rad": yaw_rad})
        return


def _cross(course: _Course, way: _Points) -> None:
    """Have somebody walk across the middle of a way, through what walls there are."""
    spots = _spots(way)
    if not spots:
        return
    (x_m, y_m), robot = course.random.choice(spots), course.at
    begin = robot
    while math.dist(begin, robot) < BEGINS_M:
        angle_rad = course.random.uniform(-math.pi, math.pi)
        dx, dy = math.cos(angle_rad), math.sin(angle_rad)
        begin = (x_m + 1.5 * dx, y_m + 1.5 * dy)
    course.person.walk([begin, (x_m, y_m), (x_m - 3.0 * dx, y_m - 3.0 * dy)], WALK_M_S)


def _spots(way: _Points) -> list[tuple[float, float]]:
    """Return points of a way that are a metre and more from its ends."""
    samples = np.vstack([np.linspace(a, b, 20) for a, b in pairwise(way)])
    return [
        (float(x_m), float(y_m))
        for x_m, y_m in samples
        if min(math.dist((x_m, y_m), way[0]), math.dist((x_m, y_m), way[-1])) > 1.0
    ]


def _follow(course: _Course, notes: _Notes) -> None:
    """Walk about for a minute, out of the robot's way, and see how far behind it stays."""
    stack = course.stack
    command_id = stack.give(text="follow me")
    stack.lockstep.run_for(2.0)
    x_m, y_m = course.at
    stroll: tuple[float, float] = (x_m + 1.2, y_m)
    away_m: list[float] = []
    end_s = stack.lockstep.now_s + 60.0
    while stack.lockstep.now_s < end_s and stack.outcome(command_id) is None:
        if not course.person.document()["walks"]:
            _stroll_on(course, stroll)
        stack.lockstep.run_for(2.0 * _LOOK_S)
        at_m = course.person.document()["at_m"]
        stroll = (at_m[0], at_m[1])
        away_m.append(math.dist(course.at, stroll))
        if course.touches():
            notes.touched()
            break
    low_m, high_m = BESIDE_M
    share = mean(low_m <= one <= high_m for one in away_m)
    notes.figures |= {"share_beside": round(share, 3), "least_m": round(min(away_m), 2)}
    notes.figures |= {"most_m": round(max(away_m), 2)}
    if (outcome := stack.outcome(command_id)) is not None:
        notes.failures.append(f"ended: {outcome.get('error') or outcome.get('reason')}")
    if share < FOLLOWED_SHARE:
        notes.failures.append(f"within {low_m} to {high_m} m for {share:.0%} of the time only")
    course.person.walk([], 1.0)
    if not stack.lockstep.run_until(lambda: stack.outcome(command_id) is not None, 30.0):
        notes.failures.append("who is followed was gone, and it did not tell")


def _stroll_on(course: _Course, at: tuple[float, float]) -> None:
    """Walk to another place by a way that leads not near the robot; stand where none does."""
    robot = np.array((course.at,))
    places = [one.pose for one in course.stack.robot.places.values()]
    course.random.shuffle(places)
    for goal in places:
        try:
            way = course.planner.around(robot, 0.45).plan(at, (goal.x_m, goal.y_m))
        except NoPath:
            continue
        if _length_m(way) <= 1.0:
            continue
        samples = np.vstack([np.linspace(a, b, 30) for a, b in pairwise(way)])
        if np.hypot(*(samples - robot).T).min() > 0.75:
            course.person.walk(way.tolist(), STROLL_M_S)
            return
    course.person.walk([list(at)], STROLL_M_S)


def _sweep(course: _Course, room: str, notes: _Notes) -> None:
    stack = course.stack
    command_id = stack.give(text=f"vacuum the {spoken(room)}")
    end_s = stack.lockstep.now_s + _SWEEP_LIMIT_S
    while (outcome := stack.outcome(command_id)) is None and stack.lockstep.now_s < end_s:
        stack.lockstep.run_for(_LOOK_S)
        if course.touches():
            notes.touched()
            break
    results = (outcome or {}).get("actions", ())
    covered = next((one["data"]["covered_ratio"] for one in results if one.get("data")), 0.0)
    notes.figures |= {"covered": covered, "took_s": round(stack.lockstep.now_s)}
    if not (outcome or {}).get("success"):
        notes.failures.append(f"{(outcome or {}).get('error') or 'no end in time'}")
    elif covered < COVERED:
        notes.failures.append(f"covered {covered:.1%} of the floor, expected {COVERED:.0%}")


def _guard(course: _Course, notes: _Notes) -> None:
    """Let nobody come, then somebody twice; each time they are reported once, and soon."""
    stack = course.stack
    room = course.random.choice(ROOMS)
    command_id = stack.give(text=f"guard the {spoken(room)}")
    post = stack.robot.places[room].pose
    if not stack.lockstep.run_until(
        lambda: math.dist(course.at, (post.x_m, post.y_m)) < SEEN_WITHIN_M, _LIMIT_S
    ):
        notes.failures.append(f"it did not get to the {spoken(room)}")
        return
    stack.lockstep.run_for(QUIET_S)
    after_s: list[float] = []
    if _reports(course, command_id):
        notes.failures.append("it reported somebody while nobody was there")
    for visit in (1, 2):
        begun = _reports(course, command_id)
        way = _way_in(course)
        course.person.walk(way, WALK_M_S)
        told_s = _until_told(course, command_id, begun)
        after_s += [] if told_s is None else [told_s]
        if told_s is None or told_s > TOLD_WITHIN_S:
            words = "not reported" if told_s is None else f"reported after {told_s:.1f} s in view"
            notes.failures.append(f"visit {visit}: {words}, expected within {TOLD_WITHIN_S:g} s")
        stack.lockstep.run_until(lambda: not course.person.document()["walks"], _LIMIT_S)
        stack.lockstep.run_for(2.0)
        course.person.walk(way[::-1], WALK_M_S)
        stack.lockstep.run_until(lambda: not course.person.document()["walks"], _LIMIT_S)
        course.person.walk([], 1.0)
        stack.lockstep.run_for(GONE_S)
        if (more := _reports(course, command_id) - begun) != 1:
            notes.failures.append(f"visit {visit}: {more} reports, expected 1")
    notes.figures |= {"told_after_s": round(max(after_s), 2) if after_s else None}
    stack.give(text="stop")
    if not stack.lockstep.run_until(lambda: stack.outcome(command_id) is not None, 5.0):
        notes.failures.append("it did not end when told to")


def _reports(course: _Course, command_id: str) -> int:
    course.stack.outcome(command_id)  # takes in the events
    said = (one["text"] for one in course.stack.events if one["event"] == "said")
    return sum("come in" in text for text in said)


def _way_in(course: _Course) -> list[list[float]]:
    """Return a way that begins out of view and ends near the robot, in view, not through it."""
    x_m, y_m = course.at
    places = [one.pose for one in course.stack.robot.places.values()]
    course.random.shuffle(places)
    planner = course.planner.around(np.array((course.at,)), 0.45)
    for start in places:
        for angle_rad in np.linspace(0.0, math.tau, 24, endpoint=False).tolist():
            end = (x_m + 1.3 * math.cos(angle_rad), y_m + 1.3 * math.sin(angle_rad))
            if not (planner.is_free(*end) and _is_seen_at(course, [*end])):
                continue
            try:
                way = _end_of(planner.plan((start.x_m, start.y_m), end))
            except NoPath:
                continue
            if not _is_seen_at(course, way[0]):
                return way
    raise NoPath(f"nobody gets to {course.at} from out of view")


def _is_seen_at(course: _Course, at: list[float]) -> bool:
    """Return whether somebody who stood there would be in view; they are there for no time."""
    course.person.walk([at], WALK_M_S)
    is_seen = course.is_in_view()
    course.person.walk([], 1.0)
    return is_seen


def _end_of(way: _Points) -> list[list[float]]:
    """Return the last COMES_M of a way."""
    samples = np.vstack([np.linspace(a, b, 50) for a, b in pairwise(way)])
    left_m = _length_m(samples) - np.cumsum(np.r_[0.0, np.hypot(*np.diff(samples, axis=0).T)])
    near: list[list[float]] = samples[left_m <= COMES_M].tolist()
    return near


def _until_told(course: _Course, command_id: str, before: int) -> float | None:
    """Return for how long somebody was in view when they were reported; None if they were not."""
    in_view_s, end_s = 0.0, course.stack.lockstep.now_s + _LIMIT_S
    while course.stack.lockstep.now_s < end_s and in_view_s < 2.0 * TOLD_WITHIN_S:
        if _reports(course, command_id) > before:
            return in_view_s
        course.stack.lockstep.run_for(_LOOK_S)
        in_view_s += _LOOK_S if course.is_in_view() else 0.0
    return None


def _inspect(course: _Course, notes: _Notes) -> None:
    stack = course.stack
    things = stack.lockstep.truth()["objects"]
    name = course.random.choice(sorted(things))
    command_id = stack.give(text=f"inspect the {spoken(name)}")
    poses: list[tuple[float, float]] = []
    end_s = stack.lockstep.now_s + 3.0 * _LIMIT_S
    while (outcome := stack.outcome(command_id)) is None and stack.lockstep.now_s < end_s:
        stack.lockstep.run_for(_LOOK_S)
        poses.append(course.at)
        if course.touches():
            notes.touched()
            break
    action = ((outcome or {}).get("actions") or [{}])[-1]
    sides = action.get("data", {}).get("sides", ())
    if not (outcome or {}).get("success") or not sides:
        notes.failures.append(f"{name}: {(outcome or {}).get('error') or 'no end in time'}")
        return
    at_m = things[name]["position_m"][:2]
    bearings = []
    for side in sides:
        stood = min(poses, key=lambda one: math.dist(one, (side["from_x_m"], side["from_y_m"])))
        bearings.append(math.atan2(stood[1] - at_m[1], stood[0] - at_m[0]))
        off_m = math.dist(side["position_m"][:2], at_m)
        if side["class"] not in name or off_m > SEEN_WITHIN_M:
            notes.failures.append(f"{name}: saw a {side['class']}, {off_m:.2f} m from it")
    apart_rad = abs(math.remainder(bearings[-1] - bearings[0], math.tau))
    notes.figures |= {"thing": name, "apart_deg": round(math.degrees(apart_rad))}
    if apart_rad < APART_RAD and "no such place" not in (action.get("note") or ""):
        notes.failures.append(f"{name}: {math.degrees(apart_rad):.0f} degrees apart, not told")


def _length_m(way: _Points) -> float:
    return float(np.hypot(*np.diff(way, axis=0).T).sum())
