"""Judge the end of a plan against a goal: conditions on the world, in a line of the corpora.

    goal      = way { "|" way }          any of them will do
    way       = condition { ";" condition }
    condition = word { argument }        as in `CONDITIONS`

A thing that no condition of a way names must be where it was: in the same hand, in or on the same.
`held cup_1; at start` is how a goal says that the cup was brought: handed over there it is, too.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final

from benchmarks.planner_flat import FURNITURE, HANDS, WITH_SPEAKER, FlatThing
from benchmarks.planner_world import FlatWorld

AT_PLACE_M: Final = 0.6
AT_START_M: Final = 0.7
NEAR_THING_M: Final = 1.0
BROUGHT: Final = ("at", "start")
SLACK_RATIO: Final = 0.05
SLACK: Final = 0.02
SLACK_DEG: Final = 3.0


class GoalUnreadable(Exception):
    """Say which goal of the corpora is none."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Goal:
    """Hold the ways to reach a goal, each as words with their arguments."""

    text: str
    ways: tuple[tuple[tuple[str, ...], ...], ...]

    def missed(self, world: FlatWorld, start: FlatWorld) -> str:
        """Return what is wrong at the end, or nothing; of several ways, of the nearest one."""
        faults = [_faults(way, world, start) for way in self.ways]
        return "" if [] in faults else "; ".join(sorted(faults, key=len)[0])


def parse_goal(text: str) -> Goal:
    """Read a goal.

    Raises:
        GoalUnreadable: it holds a word that is no condition.
    """
    ways = tuple(
        tuple(tuple(condition.split()) for condition in way.split(";")) for way in text.split("|")
    )
    for way in ways:
        for condition in way:
            if not condition or condition[0] not in CONDITIONS:
                raise GoalUnreadable(f'"{text}": expected one of {", ".join(CONDITIONS)}')
    return Goal(text=text, ways=ways)


def _faults(way: Sequence[tuple[str, ...]], world: FlatWorld, start: FlatWorld) -> list[str]:
    faults = [
        " ".join(condition)
        for condition in way
        if not CONDITIONS[condition[0]](world, start, condition[1:])
        and not (BROUGHT in way and _is_handed_over(condition, world, start))
    ]
    named = {word for condition in way for word in condition[1:]}
    return faults + [
        f"{name} was not to be touched"
        for name, thing in world.things.items()
        if name not in named and _whereabouts(thing) != _whereabouts(start.things[name])
    ]


def _is_handed_over(condition: tuple[str, ...], world: FlatWorld, start: FlatWorld) -> bool:
    """Return whether who spoke was handed the thing of `held cup_1`, where they spoke."""
    if condition[0] != "held" or len(condition) != 2:
        return False
    thing = world.things[condition[1]]
    is_there = math.dist(thing.xy_m, start.pose[:2]) <= AT_START_M
    return thing.rests == WITH_SPEAKER and is_there


def _whereabouts(thing: FlatThing) -> tuple[object, ...]:
    return thing.rests, thing.held_by


def _held(world: FlatWorld, _: FlatWorld, given: Sequence[str]) -> bool:
    """Hold `held cup_1 [left]`."""
    hand = world.things[given[0]].held_by
    return hand in (given[1:] or HANDS)


def _rests(relation: str) -> "Condition":
    """Return the condition `in cup_1 box_1` or `on cup_1 kitchen_table`."""

    def holds(world: FlatWorld, _: FlatWorld, given: Sequence[str]) -> bool:
        return world.things[given[0]].rests == (relation, given[1])

    return holds


def _down(world: FlatWorld, _: FlatWorld, given: Sequence[str]) -> bool:
    """Hold `down cup_1`: it is in no hand, but on furniture or in what stands there."""
    thing = world.things[given[0]]
    return not thing.held_by and world.furniture_of(thing) in FURNITURE


def _free(world: FlatWorld, _: FlatWorld, given: Sequence[str]) -> bool:
    """Hold `free cup_1`: it is in no hand."""
    return not world.things[given[0]].held_by


def _at(world: FlatWorld, start: FlatWorld, given: Sequence[str]) -> bool:
    """Hold `at kitchen`, or `at start`."""
    if given[0] == "start":
        return math.dist(world.pose[:2], start.pose[:2]) <= AT_START_M
    return math.dist(world.pose[:2], world.home.places[given[0]][:2]) <= AT_PLACE_M


def _near(world: FlatWorld, _: FlatWorld, given: Sequence[str]) -> bool:
    """Hold `near cup_1`."""
    return math.dist(world.pose[:2], world.place_of(world.things[given[0]])) <= NEAR_THING_M


def _found(world: FlatWorld, _: FlatWorld, given: Sequence[str]) -> bool:
    """Hold `found keys_1`: it was looked for, looked at or gone to, and so is known."""
    return given[0] in (*world.found, *world.visited_things, world.head)


def _told(world: FlatWorld, start: FlatWorld, given: Sequence[str]) -> bool:
    """Hold `told keys_1`: it was found, or the answer names where it is."""
    thing = start.things[given[0]]
    names = {world.furniture_of(thing).replace("_", " "), thing.rests[1].rpartition("_")[0]}
    words = " ".join(world.said).lower()
    return _found(world, start, given) or any(name and name in words for name in names)


def _head(world: FlatWorld, _: FlatWorld, given: Sequence[str]) -> bool:
    """Hold `head left`, or `head cup_1`."""
    return world.head == given[0]


def _moved(world: FlatWorld, _: FlatWorld, given: Sequence[str]) -> bool:
    """Hold `moved 1.5` or `moved 0.1..1`, in metres, backward negative."""
    return _fits(world.moved_m, given[0], SLACK)


def _turned(world: FlatWorld, _: FlatWorld, given: Sequence[str]) -> bool:
    """Hold `turned -90` or `turned 10..100`, in degrees, to the left positive."""
    return _fits(math.degrees(world.turned_rad), given[0], SLACK_DEG)


def _waited(world: FlatWorld, _: FlatWorld, given: Sequence[str]) -> bool:
    """Hold `waited 10`, in seconds."""
    return _fits(world.waited_s, given[0], SLACK)


def _gripper(world: FlatWorld, _: FlatWorld, given: Sequence[str]) -> bool:
    """Hold `gripper left open`, or `gripper both closed`."""
    hands = HANDS if given[0] == "both" else given[:1]
    return all(world.open_hands[hand] == (given[1] == "open") for hand in hands)


def _pose(world: FlatWorld, _: FlatWorld, given: Sequence[str]) -> bool:
    """Hold `pose tuck`, or `pose tuck left`."""
    return all(world.arm_pose[hand] == given[0] for hand in given[1:] or HANDS)


def _said(world: FlatWorld, _: FlatWorld, given: Sequence[str]) -> bool:
    """Hold `said dinner is ready`: these words were spoken."""
    return " ".join(given).lower() in " ".join(" ".join(world.said).lower().split())


def _visited(world: FlatWorld, _: FlatWorld, given: Sequence[str]) -> bool:
    """Hold `visited kitchen bedroom`: the robot was at each, one after the other."""
    left = list(given)
    for pose in world.trail:
        if left and math.dist(pose[:2], world.home.places[left[0]][:2]) <= AT_PLACE_M:
            left.pop(0)
    return not left


def _still(world: FlatWorld, start: FlatWorld, _: Sequence[str]) -> bool:
    """Hold `still`: the base has not moved."""
    return world.pose == start.pose


def _fits(value: float, wanted: str, slack: float) -> bool:
    least, _, most = wanted.partition("..")
    low, high = float(least), float(most or least)
    return low - slack - SLACK_RATIO * abs(low) <= value <= high + slack + SLACK_RATIO * abs(high)


Condition = Callable[[FlatWorld, FlatWorld, Sequence[str]], bool]
CONDITIONS: Final[Mapping[str, Condition]] = MappingProxyType(
    {
        "held": _held, "in": _rests("in"), "on": _rests("on"), "down": _down, "free": _free,
        "at": _at, "near": _near, "found": _found, "told": _told, "head": _head, "moved": _moved,
        "turned": _turned, "waited": _waited, "gripper": _gripper, "pose": _pose, "said": _said,
        "visited": _visited, "still": _still,
    }
)  # fmt: skip
