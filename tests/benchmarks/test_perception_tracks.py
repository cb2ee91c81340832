import math
from typing import Any

import numpy as np

from benchmarks.perception_tracks import IdentityWatch, _update_cost
from benchmarks.table_of_things import (
    BOX_APART_M,
    SHAPES,
    TABLE,
    draw_arrangement,
    true_snapshot,
)
from vla_deploy.world import relations_of
from vla_deploy.world.thing import Rest


def told(**places: float) -> list[dict[str, Any]]:
    return [{"id": name, "position_m": [x_m, 0.0, 0.5]} for name, x_m in places.items()]


def real(**places: float) -> dict[str, Any]:
    return {name: {"position_m": [x_m, 0.0, 0.5]} for name, x_m in places.items()}


def test_a_thing_that_goes_by_one_id_switches_none() -> None:
    watch = IdentityWatch()
    for x_m in (1.0, 1.1, 1.2):
        watch.look(told(cup_1=x_m + 0.02, box_1=3.0), real(cup=x_m, box=3.01))
    assert (watch.switches, watch.ids) == ([], {"cup": "cup_1", "box": "box_1"})
    assert (watch.looks, watch.followed, watch.false_things) == (3, 6, 0)


def test_another_id_at_the_same_thing_is_a_switch() -> None:
    watch = IdentityWatch()
    watch.look(told(cup_1=1.0), real(cup=1.0))
    watch.look(told(), real(cup=1.0))
    watch.look(told(cup_2=1.0), real(cup=1.0))
    assert watch.switches == ["cup: cup_1 -> cup_2"]


def test_two_things_that_swap_ids_are_two_switches() -> None:
    watch = IdentityWatch()
    watch.look(told(cup_1=1.0, cup_2=2.0), real(left=1.0, right=2.0))
    watch.look(told(cup_1=2.0, cup_2=1.0), real(left=1.0, right=2.0))
    assert len(watch.switches) == 2


def test_a_nearer_newcomer_does_not_take_a_name_that_still_fits() -> None:
    watch = IdentityWatch()
    watch.look(told(cup_1=1.1), real(cup=1.0))
    watch.look(told(cup_1=1.1, ghost_1=1.0), real(cup=1.0))
    assert (watch.switches, watch.false_things) == ([], 1)


def test_what_is_told_where_nothing_is_counts_as_false() -> None:
    watch = IdentityWatch()
    watch.look(told(cup_1=1.0), real(cup=2.0))
    assert (watch.ids, watch.false_things) == ({}, 1)


def test_things_are_arranged_apart_on_the_table_or_in_the_box() -> None:
    random = np.random.default_rng(0)
    in_box = 0
    for _ in range(20):
        placed = draw_arrangement(random)
        assert set(placed) == set(SHAPES)
        cup, box = placed["red_cup"], placed["box"]
        if cup[2] > TABLE.height_m:
            in_box += 1
            assert math.dist(cup[:2], box[:2]) < 0.06
            continue
        assert math.dist(cup[:2], box[:2]) > BOX_APART_M
    assert 0 < in_box < 20


def test_the_truth_is_told_by_the_world_models_own_rules() -> None:
    def body(name: str, x_m: float, on_m: float) -> dict[str, Any]:
        z_m = on_m + SHAPES[name].mass_at_m
        return {"position_m": [x_m, 1.5, z_m], "quaternion_wxyz": [1.0, 0.0, 0.0, 0.0]}

    places = {"box": (2.0, 0.45), "red_cup": (2.02, 0.458), "blue_ball": (2.3, 0.45),
              "book": (2.45, 0.45), "bottle": (2.6, 0.45)}  # fmt: skip
    objects = {name: body(name, *place) for name, place in places.items()}
    robot = {"x_m": 2.2, "y_m": 2.05, "yaw_rad": -1.57}
    snapshot = true_snapshot({"objects": objects, "robot": robot})
    rests = {one.thing_id: one.rests for one in snapshot.things}
    assert rests["red_cup"] == Rest("in", "box")
    assert rests["box"] == Rest("on", "coffee_table")
    told = {(one.subject, one.relation, one.other) for one in relations_of(snapshot)}
    # Seen from the north, what lies farther east is on the left.
    assert ("bottle", "left of", "blue_ball") in told
    assert ("blue_ball", "next to", "book") in told


def test_the_trackers_own_cost_is_measured_on_things_that_it_keeps() -> None:
    cost = _update_cost(0)
    assert cost["tracked"] == cost["things"]
    assert 0.0 < cost["cpu_p50_ms"] <= cost["cpu_p95_ms"]
