"""A flat in which commands are given: cups, a ball and a book on the coffee table, and a box."""

from collections.abc import Callable, Mapping
from typing import Any

import pytest

from vla_deploy.planning.asking import Request
from vla_deploy.planning.errors import PlanningError
from vla_deploy.planning.knowledge import world_of
from vla_deploy.planning.plan import Plan
from vla_deploy.planning.planner import checked
from vla_deploy.planning.rules import draft_plan
from vla_deploy.planning.understanding import Conversation, Outcome, Turn
from vla_deploy.planning.understanding.grounding import PUT_IN
from vla_deploy.planning.understanding.mentioned import mentions_of
from vla_deploy.planning.validator import plan_faults
from vla_deploy.robots import load_robot
from vla_deploy.world import Snapshot, Thing, Viewpoint
from vla_deploy.world.thing import Rest

HERE = (2.15, 2.05, -1.5708)
SIZES = {
    "cup": (0.066, 0.066, 0.095),
    "ball": (0.05, 0.05, 0.05),
    "book": (0.15, 0.065, 0.04),
    "box": (0.24, 0.24, 0.13),
}
ON = (
    ("cup_1", "red", 2.0, 1.5, "coffee_table"),
    ("cup_2", "blue", 2.4, 1.55, "coffee_table"),
    ("ball_1", "green", 2.2, 1.5, "coffee_table"),
    ("book_1", "purple", 2.6, 1.5, "coffee_table"),
    ("box_1", "orange", 4.2, 0.46, "side_table"),
)


def _thing(name: str, colour: str, x_m: float, y_m: float, on: str) -> Thing:
    size_m = SIZES[name.partition("_")[0]]
    return Thing(
        thing_id=name,
        kind=name.partition("_")[0],
        colour=colour,
        position_m=(x_m, y_m, 0.45 + 0.5 * size_m[2]),
        size_m=size_m,
        rests=Rest("on", on),
    )


class Flat:
    """Give commands in the flat and see what they would do."""

    def __init__(self) -> None:
        self.robot = load_robot("butler")
        self.things = tuple(_thing(*row) for row in ON)

    def request(
        self, text: str, holding: Mapping[str, str] | None = None, **changes: Any
    ) -> Request:
        robot = Viewpoint(x_m=HERE[0], y_m=HERE[1], yaw_rad=HERE[2])
        fields: dict[str, Any] = {
            "command_id": "c1",
            "text": text,
            "world": world_of(
                self.robot, {"left": None, "right": None} | dict(holding or {}), lambda *_: True
            ),
            "scene": Snapshot(stamp_ns=0, things=self.things, robot=robot),
            "here": HERE,
        }
        return Request(**(fields | changes))

    def plan(self, text: str, **changes: Any) -> Plan:
        request = self.request(text, **changes)
        return checked(draft_plan(request), request)

    def refuses_or_plans(self, text: str) -> None:
        """Expect a refusal in words, or a plan that is valid."""
        request = self.request(text)
        try:
            plan = self.plan(text)
        except PlanningError as error:
            assert str(error)
            return
        assert plan_faults(plan, request.world, request.scene, request.here) == []

    def does(self, text: str, **changes: Any) -> str:
        """Return the steps of a command in short, without what grounding puts in."""
        return _in_short(self.plan(text, **changes), frozenset({PUT_IN}))

    def after(self, *texts: str, outcome: Outcome = Outcome.SUCCEEDED) -> Conversation:
        """Return the conversation after commands that were planned and ended so."""
        talk = Conversation()
        for number, text in enumerate(texts):
            plan = self.plan(text, conversation=talk)
            turn = Turn(
                said=text,
                command_id=f"c{number}",
                mentioned=mentions_of(plan, self.request(text).scene),
                plan=plan,
                outcome=outcome,
                here=HERE,
                in_full=plan.goal,
            )
            talk = talk.after(turn)
        return talk

    def goes_on(self, talk: str) -> str:
        """Return what the last of several commands does, with what is taken for it.

        They are parted by ">>".
        """
        *before, text = [one.strip() for one in talk.split(">>")]
        plan = self.plan(text, conversation=self.after(*before))
        return _in_short(plan, frozenset({PUT_IN}), frozenset({"pick_up"}))


def _in_short(plan: Plan, without: frozenset[str], but: frozenset[str] = frozenset()) -> str:
    return "; ".join(
        " ".join([one.skill, *(str(value) for value in one.parameters.values())])
        for one in plan.actions
        if one.description not in without or one.skill in but
    )


@pytest.fixture(scope="session")
def flat() -> Flat:
    """Return the flat."""
    return Flat()


@pytest.fixture(scope="session")
def goes_on(flat: Flat) -> Callable[[str], str]:
    """Return what the last of several commands does."""
    return flat.goes_on


@pytest.fixture(scope="session")
def does(flat: Flat) -> Callable[..., str]:
    """Return what a command does."""
    return flat.does
