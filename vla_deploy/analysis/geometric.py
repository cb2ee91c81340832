"""Analyse a scene by the robot's own measurements: always there, the same answer every time."""

import math
from collections.abc import Iterator
from typing import Final

from vla_deploy.analysis.document import (
    AnalysedObject,
    AnalysedRelation,
    Distance,
    EvidenceSource,
    SceneAnalysis,
    Side,
    SizeClass,
)
from vla_deploy.feasibility.abilities import Abilities
from vla_deploy.feasibility.actions import judge_actions
from vla_deploy.feasibility.outlook import Outlook
from vla_deploy.feasibility.question import SceneQuestion
from vla_deploy.feasibility.verdict import Feasible, Task
from vla_deploy.planning.errors import NotUnderstood
from vla_deploy.planning.patterns.backend import plan_command
from vla_deploy.plans.catalogue import GRASPABLE_CLASSES
from vla_deploy.plans.errors import PlanError
from vla_deploy.plans.knowledge import World
from vla_deploy.plans.plan import Plan
from vla_deploy.world import Body, Snapshot, Thing, Viewpoint, access_to, relations_of
from vla_deploy.world.memory import still_there
from vla_deploy.world.vocabulary import distance_word, size_word

# Within this of straight ahead a thing is in the centre: a third of the camera's view.
CENTRE_RAD: Final = math.radians(12.0)
_DIGITS: Final = 3
GEOMETRIC: Final = "geometric"
NO_POSE: Final = "the robot's pose is not known: no sides, no distances, no ways"


def objects_of(world: Snapshot, body: Body) -> Iterator[AnalysedObject]:
    """Yield every known thing; side and distance are None where the robot's pose is not known."""
    for thing in world.things:
        access = access_to(thing, world, body)
        yield AnalysedObject(
            id=thing.thing_id,
            name=thing.kind,
            colour=thing.colour,
            side=side_of(thing, world.robot),
            distance=distance_of(thing, world.robot),
            size=SizeClass(size_word(thing)),
            graspable=thing.kind in GRASPABLE_CLASSES and access.is_graspable,
            accessible=access.is_accessible,
            confidence=round(still_there(thing, world.unseen_s(thing)), _DIGITS),
            source=EvidenceSource.GEOMETRY,
        )


def relations_between(world: Snapshot) -> Iterator[AnalysedRelation]:
    """Yield every relation that holds."""
    for one in relations_of(world):
        yield AnalysedRelation(subject=one.subject, relation=one.relation, other=one.other)


def side_of(thing: Thing, robot: Viewpoint | None) -> Side | None:
    """Return on which side of the robot a thing is."""
    if robot is None:
        return None
    bearing_rad = math.atan2(thing.position_m[1] - robot.y_m, thing.position_m[0] - robot.x_m)
    aside_rad = math.remainder(bearing_rad - robot.yaw_rad, 2.0 * math.pi)
    if abs(aside_rad) <= CENTRE_RAD:
        return Side.CENTRE
    return Side.LEFT if aside_rad > 0.0 else Side.RIGHT


def distance_of(thing: Thing, robot: Viewpoint | None) -> Distance | None:
    """Return how far from the robot a thing is."""
    if robot is None:
        return None
    return Distance(distance_word(math.dist(thing.xy_m, (robot.x_m, robot.y_m))))


def judge_goal(question: SceneQuestion, abilities: Abilities) -> Task:
    """Return the verdict on the question's goal: patterns plan it, and the steps are judged."""
    outlook = Outlook.of(question, abilities)
    try:
        plan = _plan(outlook)
    except NotUnderstood as error:
        return outlook.verdict(Feasible.UNKNOWN, 0.0, str(error))
    except PlanError as error:
        return outlook.verdict(Feasible.NO, 1.0, str(error))
    return judge_actions(plan.actions, outlook)


def _plan(outlook: Outlook) -> Plan:
    question, abilities = outlook.question, outlook.abilities
    robot = question.world.robot
    here = None if robot is None else (robot.x_m, robot.y_m, robot.yaw_rad)
    world = World(places=abilities.spoken, poses=abilities.poses, holding=outlook.holding)
    return plan_command(question.goal, world, here)


class GeometricAnalyser:
    """Describe what the world model holds, and judge goals by reach, ways, hands and containers."""

    def __init__(self, abilities: Abilities) -> None:
        self._abilities = abilities

    def analyse(self, question: SceneQuestion) -> SceneAnalysis:
        """Return the analysis; the image is not looked at."""
        world = question.world
        return SceneAnalysis(
            stamp_ns=world.stamp_ns,
            analyser=GEOMETRIC,
            objects=tuple(objects_of(world, self._abilities.body)),
            relations=tuple(relations_between(world)),
            task=judge_goal(question, self._abilities) if question.goal else None,
            notes=() if world.robot is not None else (NO_POSE,),
        )
