"""Analyse a scene by the robot's own measurements: always there, the same answer every time."""

from typing import Final

from vla_deploy.analysis.describing import objects_of, relations_between
from vla_deploy.analysis.document import SceneAnalysis
from vla_deploy.analysis.goal_feasibility import judge_goal
from vla_deploy.feasibility.abilities import Abilities
from vla_deploy.feasibility.question import SceneQuestion

GEOMETRIC: Final = "geometric"
NO_POSE: Final = "the robot's pose is not known: no sides, no distances, no ways"


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
