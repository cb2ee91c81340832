"""Hold the state that the steps to a goal lead to, while they are judged one by one."""

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Final

import numpy as np

from vla_deploy.feasibility.abilities import Abilities
from vla_deploy.feasibility.question import SceneQuestion
from vla_deploy.feasibility.verdict import Feasible, Task
from vla_deploy.navigation.errors import NoPath
from vla_deploy.plans.catalogue import GRASPABLE_CLASSES
from vla_deploy.world import Query, Thing, access_to, find
from vla_deploy.world.memory import still_there, where_to_look

Point = tuple[float, float]

MOST_ALTERNATIVES: Final = 3
_DIGITS: Final = 3
# The way is planned on the map, which has no people and chairs: they stand next to it or on it.
BESIDE_WAY_M: Final = 0.3


class CannotBe(Exception):
    """End the way to a goal: `belief` is how sure the reason is."""

    def __init__(self, reason: str, belief: float = 1.0) -> None:
        super().__init__(reason)
        self.belief = belief


@dataclass(slots=True, kw_only=True)
class Outlook:
    """Hold the state that the steps so far would lead to, and what was found on the way.

    `belief` is the probability that all things are as the steps need them; `unseen` are things
    that have not been seen yet, of which nothing can be said.
    """

    question: SceneQuestion
    abilities: Abilities
    holding: dict[str, str | None]
    at: Point | None
    held: Thing | None = None
    belief: float = 1.0
    unseen: list[str] = field(default_factory=list)
    prerequisites: list[str] = field(default_factory=list)
    obstacles: list[str] = field(default_factory=list)
    alternatives: list[str] = field(default_factory=list)
    relied_on: set[str] = field(default_factory=set)

    @classmethod
    def of(cls, question: SceneQuestion, abilities: Abilities) -> "Outlook":
        """Return what is known before the first step."""
        robot = question.world.robot
        held = next((thing for thing in question.world.things if thing.held_by), None)
        holding = {name: question.holding.get(name) for name in abilities.body.hands}
        if held is not None:
            holding[held.held_by] = holding.get(held.held_by) or held.kind
        return cls(
            question=question,
            abilities=abilities,
            holding=holding,
            held=held,
            at=None if robot is None else (robot.x_m, robot.y_m),
        )

    def verdict(self, feasible: Feasible, belief: float, reason: str) -> Task:
        """Return the verdict with what the steps have found."""
        return Task(
            goal=self.question.goal,
            feasible=feasible,
            confidence=round(belief, _DIGITS),
            reason=reason,
            prerequisites=tuple(self.prerequisites),
            obstacles=tuple(dict.fromkeys(self.obstacles)),
            alternatives=tuple(dict.fromkeys(self.alternatives))[:MOST_ALTERNATIVES],
        )

    def meant(self, query: Query) -> Thing | None:
        """Return the thing meant, the nearest of several; note one that has not been seen."""
        world = self.question.world
        found = find(query, world)
        if found:
            self._rely_on(found[0])
            return found[0]
        if str(query) not in self.unseen:
            self.unseen.append(str(query))
            self.prerequisites.append(f"find the {query}: it has not been seen{self._hint(query)}")
            self.alternatives += self._others(query)
        return None

    def drive(self, goal: Point, what: str) -> None:
        """Go to a point of the floor.

        Raises:
            CannotBe: no way leads there.
        """
        if self.at is None:
            self.need("find out where the robot is")
        else:
            try:
                way = self.abilities.planner.plan(self.at, goal)
            except NoPath as error:
                raise CannotBe(f"no way leads to {what}: {error}") from error
            self.obstacles += self._beside(way, what)
        self.at = goal

    def need(self, prerequisite: str) -> None:
        """Note what must be done before, once."""
        if prerequisite not in self.prerequisites:
            self.prerequisites.append(prerequisite)

    def others_like(self, thing: Thing) -> Iterator[str]:
        """Yield things that could be taken in place of one."""
        world = self.question.world
        for other in world.things:
            alike = other.kind == thing.kind or other.colour == thing.colour
            if other is thing or not alike or other.kind not in GRASPABLE_CLASSES:
                continue
            if access_to(other, world, self.abilities.body).is_accessible:
                yield f"take the {other} ({other.thing_id})"

    def _rely_on(self, thing: Thing) -> None:
        if thing.thing_id not in self.relied_on:
            self.relied_on.add(thing.thing_id)
            self.belief *= still_there(thing, self.question.world.unseen_s(thing))

    def _hint(self, query: Query) -> str:
        guesses = where_to_look(query, self.question.world, {})
        return f"; it was {guesses[0].place}" if guesses and guesses[0].place != "unknown" else ""

    def _others(self, query: Query) -> list[str]:
        wanted = {query.kind, query.colour} - {"", "object"}
        return [
            f"take the {thing} ({thing.thing_id})"
            for thing in self.question.world.things
            if thing.kind in GRASPABLE_CLASSES and wanted & {thing.kind, thing.colour}
        ][:MOST_ALTERNATIVES]

    def _beside(self, way: np.ndarray, what: str) -> Iterator[str]:
        for one in self.question.bystanders:
            gap_m = _distance_m(way, (one.x_m, one.y_m)) - 0.5 * one.width_m
            if gap_m < BESIDE_WAY_M:
                yield f"a {one.kind} stands {max(gap_m, 0.0):.1f} m beside the way to {what}"


def _distance_m(way: np.ndarray, point: Point) -> float:
    """Return the distance from a point to a line of (n, 2) points."""
    nearest = math.inf
    for start, end in itertools.pairwise(way):
        along = end - start
        share = float(np.dot(np.array(point) - start, along)) / max(float(along @ along), 1e-12)
        foot = start + min(1.0, max(0.0, share)) * along
        nearest = min(nearest, math.dist(foot, point))
    return nearest
