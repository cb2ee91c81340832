"""In which order a search goes to the viewpoints of the home."""

from typing import TYPE_CHECKING, Any

import pytest

from drivers.clock import NS_PER_S
from vla_deploy.robots.floor_pose import Pose2D
from vla_deploy.skills.actions import find
from vla_deploy.skills.context import Skill, SkillContext
from vla_deploy.skills.errors import NotPossible, TryAgain

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


def view_of(context: SkillContext, place: str) -> Pose2D:
    return context.robot.places[place].viewpoints[0]


def nothing(*_: object, **__: object) -> Skill:
    return
    yield


def test_what_was_looked_at_lately_comes_last_and_each_viewpoint_once_in_all_tries(
    context: SkillContext, standing: "StandingLink", monkeypatch: pytest.MonkeyPatch
) -> None:
    visited: list[Pose2D] = []

    def drive_to(context: SkillContext, goal: Pose2D, **_: object) -> Skill:
        visited.append(goal)
        if goal == view_of(context, "side_table"):
            raise NotPossible("the way is closed")
        yield

    monkeypatch.setattr(find, "drive_to", drive_to)
    for name in ("_look_around", "_sweep", "carry", "turn_head"):
        monkeypatch.setattr(find, name, nothing)
    now_ns = standing.clock.now_ns()
    for place, ago_s in (("coffee_table", 90.0), ("kitchen_table", 400.0), ("side_table", 3600.0)):
        context.looked[view_of(context, place)] = now_ns - round(ago_s * NS_PER_S)
    with pytest.raises(TryAgain) as refused:
        list(find.find_object(context, {"object": "box"}))
    order = ("side_table", "bedside_table", "kitchen_table", "coffee_table")
    assert set(visited[:2]) == {view_of(context, one) for one in order[:2]}
    assert visited[2:] == [view_of(context, one) for one in order[2:]]
    assert "looked at: bedside table, kitchen table, coffee table" in str(refused.value)
    assert "could not get to: side table" in str(refused.value)
    with pytest.raises(TryAgain):
        list(find.find_object(context, {"object": "box"}))
    assert visited[4:] == [view_of(context, "side_table")]
