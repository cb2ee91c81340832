import json
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest

from vla_deploy.robots import load_robot
from vla_deploy.world import Body, SceneUnreadable, Snapshot, Thing, parse_query, read_snapshot
from vla_deploy.world.document import read_report, report
from vla_deploy.world.thing import Lost, Rest, Surface, Viewpoint

OLD = {"id": "cup_1", "class": "cup", "colour": "red", "position_m": [1.0, 2.0, 0.5]}
STAMP_NS = 9_000_000_000
SEEN_NS = 1_500_000_000


def test_an_older_writers_document_is_read_with_defaults() -> None:
    snapshot = read_snapshot({"stamp_ns": 5, "objects": [OLD]})
    (cup,) = snapshot.things
    assert (cup.thing_id, cup.rests, cup.held_by, cup.sigma_m) == ("cup_1", None, "", (0, 0, 0))
    assert (snapshot.robot, snapshot.lost, snapshot.surfaces) == (None, (), ())


def test_all_that_a_scene_tells_is_read() -> None:
    told = OLD | {
        "rests": {"relation": "in", "of": "box_1"}, "aliases": ["cup_2"], "last_seen_ns": 4,
    }  # fmt: skip
    snapshot = read_snapshot(
        {
            "stamp_ns": 5,
            "objects": [told],
            "lost": [OLD | {"id": "cup_3", "cause": "the left hand lost it"}],
            "surfaces": [{"name": "desk", "height_m": 0.7, "polygon_m": [[0, 0], [1, 0], [1, 1]]}],
            "robot": {"x_m": 1.0, "y_m": 2.0, "yaw_rad": 0.5},
            "hands": {"left": {"holding": None}},
        },
        now_ns=2_000_000_004,
    )
    thing = snapshot.thing("cup_2")
    assert thing is not None
    assert thing.rests == Rest("in", "box_1")
    assert snapshot.unseen_s(thing) == 2.0
    assert (snapshot.lost[0].thing.thing_id, snapshot.lost[0].cause[:8]) == ("cup_3", "the left")
    assert snapshot.surfaces[0].name == "desk"
    assert snapshot.robot is not None
    assert snapshot.thing("cup_9") is None


@pytest.mark.parametrize(
    "spoiled",
    [
        {},
        {"stamp_ns": 5},
        {"stamp_ns": 5, "objects": [{"id": "cup_1"}]},
        {"stamp_ns": 5, "objects": [OLD | {"position_m": [1.0, 2.0]}]},
        {"stamp_ns": 5, "objects": [OLD | {"size_m": "large"}]},
        {"stamp_ns": 5, "objects": None},
    ],
)
def test_what_is_no_scene_is_refused_with_what_was_expected(spoiled: dict[str, Any]) -> None:
    with pytest.raises(SceneUnreadable, match=r"expected stamp_ns and objects"):
        read_snapshot(spoiled)


def told(snapshot: Snapshot, view: Viewpoint | None = None) -> dict[str, Any]:
    """Report everything, and send it through JSON as `vla-deploy scene --json` does."""
    body = Body.of(load_robot("butler"), lambda _x_m, _y_m: True)
    words = report(snapshot, parse_query("", {}), body, {}, view)
    return dict(json.loads(json.dumps(words)))


def test_a_report_is_read_back_as_the_world_it_tells_of(
    thing: Callable[..., Thing], world: Callable[..., Snapshot]
) -> None:
    cup = thing(
        "cup_1", 1.0, 0.25, last_seen_ns=SEEN_NS, sigma_m=(0.01, 0.02, 0.03), yaw_rad=0.5,
        rests=Rest("on", "desk"), aliases=("cup_3",),
    )  # fmt: skip
    held = thing("ball_1", 0.5, 0.0, on_m=0.5, held_by="left", last_seen_ns=STAMP_NS)
    gone = Lost(
        thing=thing("bottle_1", 2.0, 1.0, last_seen_ns=SEEN_NS, rests=Rest("on", "desk")),
        cause="the left hand lost it",
    )
    desk = Surface(name="desk", height_m=0.45, polygon_m=((0.5, 0.0), (1.5, 0.0), (1.5, 1.0)))
    snapshot = world(
        held, cup, stamp_ns=STAMP_NS, lost=(gone,), surfaces=(desk,),
        hands={"left": {"class": "ball", "cause": ""}},
    )  # fmt: skip
    assert read_report(told(snapshot)) == snapshot


def test_the_robot_stands_where_it_stood_not_where_the_view_was_from(
    world: Callable[..., Snapshot],
) -> None:
    kitchen = Viewpoint(x_m=6.0, y_m=4.0, yaw_rad=1.0, name="kitchen")
    assert read_report(told(world(), kitchen)).robot == Viewpoint(x_m=0.0, y_m=0.0)
    assert read_report(told(replace(world(), robot=None))).robot is None


@pytest.mark.parametrize(
    "spoiled", [{}, {"stamp_ns": 1, "things": [7]}, {"stamp_ns": 1, "things": [], "lost": [{}]}]
)
def test_what_is_no_report_is_refused_with_what_was_expected(spoiled: dict[str, Any]) -> None:
    with pytest.raises(SceneUnreadable, match="expected what vla-deploy scene --json prints"):
        read_report(spoiled)
