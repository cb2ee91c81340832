from typing import Any

import pytest

from vla_deploy.world import SceneUnreadable, read_snapshot
from vla_deploy.world.thing import Rest

OLD = {"id": "cup_1", "class": "cup", "colour": "red", "position_m": [1.0, 2.0, 0.5]}


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
