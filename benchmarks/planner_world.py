"""Hold the flat in which plans are judged: where the robot and the things are, what has been done.

It shares no code with the robot's own check of plans, so that no fault of that check hides here.
"""

import math
from dataclasses import dataclass, field, replace
from typing import Final

from benchmarks.planner_flat import FURNITURE, HANDS, FlatHome, FlatThing, Point, Pose
from benchmarks.planner_words import meant

STAND_M: Final = 0.48


class ActionFails(Exception):
    """Say which action cannot be carried out, and why."""


@dataclass(slots=True, kw_only=True)
class FlatWorld:
    """Hold the flat as it is after each action, and what the robot did on the way.

    `chosen` settles what an expression means that fits several things: the judge tries each.
    `keeps_out` are the places that the plan says it does not enter.
    """

    home: FlatHome
    pose: Pose
    things: dict[str, FlatThing]
    open_hands: dict[str, bool | None] = field(default_factory=lambda: dict.fromkeys(HANDS))
    arm_pose: dict[str, str] = field(default_factory=lambda: dict.fromkeys(HANDS, ""))
    head: str = ""
    trail: list[Pose] = field(default_factory=list)
    visited_things: list[str] = field(default_factory=list)
    found: list[str] = field(default_factory=list)
    said: list[str] = field(default_factory=list)
    waited_s: float = 0.0
    turned_rad: float = 0.0
    moved_m: float = 0.0
    chosen: dict[str, str] = field(default_factory=dict)
    open_choices: dict[str, list[str]] = field(default_factory=dict)
    keeps_out: frozenset[str] = frozenset()

    def held_in(self, hand: str) -> FlatThing | None:
        """Return what a hand holds."""
        return next((one for one in self.things.values() if one.held_by == hand), None)

    def place_of(self, thing: FlatThing) -> Point:
        """Return where a thing is: in the hand, in what it rests in, or where it stands."""
        if thing.held_by:
            return self.pose[:2]
        other = self.things.get(thing.rests[1])
        return self.place_of(other) if other else thing.xy_m

    def furniture_of(self, thing: FlatThing) -> str:
        """Return what furniture a thing is on, also within a box that stands there."""
        other = self.things.get(thing.rests[1])
        return self.furniture_of(other) if other else thing.rests[1]

    def known(self, text: object, among_all: bool = False) -> FlatThing:
        """Return the thing that an action names.

        Raises:
            ActionFails: the robot knows none such.
        """
        listed = [
            replace(one, xy_m=self.place_of(one))
            for one in self.things.values()
            if among_all or one.is_seen
        ]
        named = [one for one in listed if text in (one.thing_id, *one.aliases)]
        found = named or meant(str(text), listed, self.pose[:2], self._surfaces())
        if not found:
            raise ActionFails(f'no "{text}" is known')
        key = str(text)
        if len(found) > 1 and key not in self.chosen:
            self.open_choices[key] = [one.thing_id for one in found]
        wanted = self.chosen.get(key, found[0].thing_id)
        chosen = next((one for one in found if one.thing_id == wanted), found[0])
        return self.things[chosen.thing_id]

    def stand_at(self, pose: Pose) -> None:
        """Take the robot to a pose.

        Raises:
            ActionFails: the robot must not be there.
        """
        if self.home.is_kept_out(pose[:2]):
            raise ActionFails(f"{pose[0]:.2f}, {pose[1]:.2f} m is no floor to drive on")
        self.pose = pose
        self.trail.append(pose)

    def _surfaces(self) -> dict[str, str]:
        return {spoken: name for spoken, name in self.home.spoken.items() if name in FURNITURE}

    def beside(self, thing: FlatThing) -> Pose:
        """Return where the robot stands to take a thing: before the furniture it is on."""
        x_m, y_m = self.place_of(thing)
        place = self.home.places.get(self.furniture_of(thing))
        from_x_m, from_y_m = (x_m + 1.0, y_m) if place is None else place[:2]
        away_m = math.dist((x_m, y_m), (from_x_m, from_y_m)) or 1.0
        ratio = STAND_M / away_m
        stand = (x_m + (from_x_m - x_m) * ratio, y_m + (from_y_m - y_m) * ratio)
        return (*stand, math.atan2(y_m - stand[1], x_m - stand[0]))
