"""In which order a search goes to the viewpoints of the home."""

from typing import TYPE_CHECKING, Any

import pytest

from drivers.clock import NS_PER_S
from vla_deploy.robots.floor_pose import Pose2D
from vla_deploy.skills.actions import find
from vla_deploy.skills.context import Skill, SkillContext
from vla_deploy.skills.errors import TryAgain

if TYPE_CHECKING:
    from conftest import StandingLink

AT_COFFEE_TABLE = Pose2D(2.2, 2.05, -1.57)
COFFEE_TABLE, KITCHEN_TABLE = (2.2, 1.5), (6.3, 4.4)


def seen(kind: str, xy_m: tuple[float, float], ago_s: float, now_ns: int) -> dict[str, Any]:
    return {
        "id": f"{kind}_1",
        "class": kind,
        "colour": "red",
        "position_m": [*xy_m, 0.5],
        "last_seen_ns": now_ns - round(ago_s * NS_PER_S),
        "confidence": 0.9,
    }


# What was seen, where and how long ago; where a search for the box begins and ends.
ORDERS = {
    "the nearest first": ((), "coffee_table", None),
    "where it was, though long ago": ((("box", KITCHEN_TABLE, 900.0),), "kitchen_table", None),
    "last where one has just looked": ((("book", COFFEE_TABLE, 2.0),), None, "coffee_table"),
    "a look of an hour ago is none": ((("book", COFFEE_TABLE, 3600.0),), "coffee_table", None),
}


@pytest.mark.parametrize("order", ORDERS)
def test_a_search_goes(
    order: str, context: SkillContext, standing: "StandingLink", monkeypatch: pytest.MonkeyPatch
) -> None:
    things, first, last = ORDERS[order]
    visited: list[Pose2D] = []

    def searched(_: SkillContext, viewpoint: Pose2D, __: object) -> Skill:
        visited.append(viewpoint)
        yield

    def looked(*_: object) -> Skill:
        yield

    monkeypatch.setattr(find, "_search_from", searched)
    monkeypatch.setattr(find, "_look_around", looked)
    standing.pose = AT_COFFEE_TABLE
    standing.objects = [seen(*one, standing.clock.now_ns()) for one in things]
    with pytest.raises(TryAgain):
        list(find.find_object(context, {"object": "box"}))
    places = context.robot.places
    for name, viewpoint in ((first, visited[0]), (last, visited[-1])):
        assert name is None or viewpoint in places[name].viewpoints
