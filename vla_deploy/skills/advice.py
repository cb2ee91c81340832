"""Tell of an action that failed what must be done before it, or what could be done instead."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Final

from vla_deploy.client.place_state import PlaceState
from vla_deploy.feasibility.abilities import Abilities
from vla_deploy.feasibility.actions import judge_action
from vla_deploy.feasibility.question import SceneQuestion
from vla_deploy.feasibility.verdict import Task
from vla_deploy.plans.plan import Action
from vla_deploy.skills.context import Held, SkillContext
from vla_deploy.skills.errors import TryAgain
from vla_deploy.world import Viewpoint

MOST_TOLD: Final = 2
"""Of the things to do before; a person asks again after those."""


class Adviser:
    """Judge failed actions by measurement, against the world as perception tells it now."""

    def __init__(self, context: SkillContext) -> None:
        """Read what the robot can do.

        Raises:
            MapInvalid: its map cannot be used.
        """
        self._context = context
        self._abilities = Abilities.of(context.robot, context.planner)

    def advice_on(self, action: Action) -> str:
        """Return a sentence, or "" where measurement finds nothing to do before or instead.

        A robot that does not see the world, or does not know where it is, advises nothing.
        """
        world, robot = self._context.link.snapshot(), self._here()
        if world is None or robot is None:
            return ""
        question = SceneQuestion(
            world=replace(world, robot=robot), holding=_kinds(self._context.hands)
        )
        return in_words(judge_action(action, question, self._abilities))

    def _here(self) -> Viewpoint | None:
        if self._context.link.place_state is PlaceState.LOST:
            return None
        try:
            pose = self._context.link.pose
        except TryAgain:
            return None
        return Viewpoint(x_m=pose.x_m, y_m=pose.y_m, yaw_rad=pose.yaw_rad)


def in_words(task: Task) -> str:
    """Return what a verdict says to do before or instead, as a sentence without a full stop."""
    if task.prerequisites:
        return f"First {', and '.join(task.prerequisites[:MOST_TOLD])}"
    if task.alternatives:
        return f"I could {task.alternatives[0]} instead"
    return ""


def _kinds(hands: Mapping[str, Held | None]) -> dict[str, str | None]:
    return {name: None if held is None else held.kind for name, held in hands.items()}
