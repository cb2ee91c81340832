"""A plan that keeps out of places neither searches them nor drives to what lies there."""

from typing import TYPE_CHECKING, Any

import pytest

from drivers.clock import NS_PER_S
from vla_deploy.plans.knowledge import parse_object
from vla_deploy.robots.floor_pose import Pose2D
from vla_deploy.skills.actions import find
from vla_deploy.skills.actions.navigate import reach
from vla_deploy.skills.context import Skill, SkillContext
from vla_deploy.skills.errors import NotPossible, TryAgain

if TYPE_CHECKING:
    from conftest import StandingLink

KITCHEN = frozenset({"kitchen", "kitchen_table"})


def thing(name: str, of: str) -> dict[str, Any]:
    return {
        "id": name,
        "class": name.partition("_")[0],
        "colour": "red",
        "position_m": [2.0, 2.0, 0.5],
        "last_seen_ns": 1000 * NS_PER_S,
        "confidence": 0.9,
        "rests": {"relation": "on", "of": of},
    }


def test_a_search_goes_to_every_other_viewpoint_and_says_what_it_leaves_out(
    context: SkillContext, monkeypatch: pytest.MonkeyPatch
) -> None:
    visited: list[Pose2D] = []
    said: list[str] = []

    def searched(_: SkillContext, viewpoint: Pose2D, __: object) -> Skill:
        visited.append(viewpoint)
        yield

    def looked(*_: object) -> Skill:
        yield

    def spoken(_: SkillContext, parameters: dict[str, str]) -> Skill:
        said.append(parameters["text"])
        yield

    monkeypatch.setattr(find, "speak", spoken)
    monkeypatch.setattr(find, "_search_from", searched)
    monkeypatch.setattr(find, "_look_around", looked)
    context.keeps_out = KITCHEN
    with pytest.raises(TryAgain, match="left out the kitchen and the kitchen table"):
        list(find.find_object(context, {"object": "red cup"}))
    places = context.robot.places
    every = {view for one in places.values() for view in one.viewpoints}
    assert set(visited) == every - set(places["kitchen"].viewpoints)
    assert said == ["I leave out the kitchen and the kitchen table."]


@pytest.mark.parametrize("of", ["kitchen_table", "box_1"])
def test_what_lies_there_is_not_driven_to(
    context: SkillContext, standing: "StandingLink", of: str
) -> None:
    standing.objects = [thing("cup_1", of), thing("box_1", "kitchen_table")]
    context.keeps_out = KITCHEN
    with pytest.raises(NotPossible, match="at the kitchen table, where I was told not to go"):
        list(reach(context, parse_object("red cup")))
