"""Each rule, broken once and kept once."""

from dataclasses import replace
from typing import Any

import pytest

from vla_deploy.plans.catalogue import SKILLS
from vla_deploy.plans.knowledge import World, world_of
from vla_deploy.plans.plan import Action
from vla_deploy.plans.symbolic.simulation import (
    bounds_faults,
    end_state,
    in_turn,
    symbolic_faults,
)
from vla_deploy.plans.symbolic.table import LOGIC
from vla_deploy.robots import load_robot
from vla_deploy.world import Snapshot, Thing, Viewpoint
from vla_deploy.world.thing import Rest

EMPTY: dict[str, str | None] = {"left": None, "right": None}
HERE = (2.15, 2.05, -1.5708)
ON_TABLE = Rest("on", "coffee_table")


def thing(name: str, x_m: float = 2.0, y_m: float = 1.5, **changes: Any) -> Thing:
    fields: dict[str, Any] = {
        "thing_id": name,
        "kind": name.partition("_")[0],
        "colour": "red",
        "position_m": (x_m, y_m, 0.5),
        "size_m": (0.066, 0.066, 0.095),
        "rests": ON_TABLE,
    }
    return Thing(**(fields | changes))


BOX = thing("box_1", 4.2, 0.46, size_m=(0.24, 0.24, 0.13), colour="orange")


@pytest.fixture(scope="module")
def butler() -> World:
    return world_of(load_robot("butler"), EMPTY)


def chain(*steps: tuple[str, dict[str, Any]]) -> tuple[Action, ...]:
    return tuple(
        Action(
            id=f"a{number}",
            skill=skill,
            parameters=parameters,
            depends_on=(f"a{number - 1}",) if number > 1 else (),
        )
        for number, (skill, parameters) in enumerate(steps, start=1)
    )


def faults(
    world: World, *steps: tuple[str, dict[str, Any]], scene: Snapshot | None = None
) -> list[str]:
    return symbolic_faults(chain(*steps), world, scene, HERE)


def seen(*things: Thing) -> Snapshot:
    robot = Viewpoint(x_m=HERE[0], y_m=HERE[1], yaw_rad=HERE[2])
    return Snapshot(stamp_ns=0, things=things, robot=robot)


CUP = {"object": "red cup"}
INTO_BOX = {"destination": "box", "relation": "in"}
FETCH = (("find_object", CUP), ("navigate_to", CUP), ("pick_up", CUP))
BESIDE_BOOK = {"destination": "book_1", "relation": "next to"}
TO_BOOK = (("find_object", {"object": "book_1"}), ("navigate_to", {"object": "book_1"}))
TO_BOX = (("find_object", {"object": "box"}), ("navigate_to", {"object": "box"}))


def test_the_main_plan_keeps_every_rule(butler: World) -> None:
    scene = seen(thing("cup_1"), BOX)
    assert faults(butler, *FETCH, *TO_BOX, ("place", INTO_BOX), scene=scene) == []
    state = end_state(chain(*FETCH, *TO_BOX, ("place", INTO_BOX)), butler, scene, HERE)
    assert state.held == ()
    assert state.rests == {"cup_1": Rest("in", "box_1")}
    assert state.at == "box_1"


def test_what_is_put_beside_a_thing_rests_where_that_rests(butler: World) -> None:
    scene = seen(thing("cup_1"), thing("book_1"))
    assert faults(butler, *FETCH, *TO_BOOK, ("place", BESIDE_BOOK), scene=scene) == []
    state = end_state(chain(*FETCH, *TO_BOOK, ("place", BESIDE_BOOK)), butler, scene, HERE)
    assert state.rests == {"cup_1": Rest("on", "coffee_table")}


@pytest.mark.parametrize(
    ("rests", "why"),
    [
        (Rest("in", "box_1"), "the book_1 is in the box_1: put it in there as well"),
        (Rest("on", "floor"), "nothing is put down on the floor"),
    ],
)
def test_not_everything_has_room_beside_it(butler: World, rests: Rest, why: str) -> None:
    scene = seen(thing("cup_1"), thing("book_1", rests=rests))
    (fault,) = faults(butler, *FETCH, *TO_BOOK, ("place", BESIDE_BOOK), scene=scene)
    assert why in fault


@pytest.mark.parametrize(
    ("steps", "broken"),
    [
        (
            [("place", {"destination": "coffee_table", "relation": "on"})],
            'action "a1": place breaks "something held": no hand holds anything',
        ),
        (
            [("hand_over", {})],
            'action "a1": hand_over breaks "something held": no hand holds anything',
        ),
        (
            [*FETCH, ("hand_over", {}), ("hand_over", {})],
            'action "a5": hand_over breaks "something held": no hand holds anything',
        ),
        (
            [*FETCH, ("place", {"destination": "cup_1", "relation": "on"})],
            'action "a4": place breaks "not onto itself": a hand holds the cup_1 itself',
        ),
        ([*FETCH, ("open_gripper", {})], 'action "a4": open_gripper breaks "nothing dropped"'),
        (
            [*FETCH, ("navigate_to", {"object": "ball"}),
             ("place", {"destination": "ball", "relation": "in"})],
            '"destination takes things": a ball is no container; things go into: bowl, box',
        ),
        (
            [*FETCH, ("place", INTO_BOX)],
            'action "a4": place breaks "robot before it": the box is 2.4 m away',
        ),
        (
            [("find_object", CUP), ("navigate_to", {"place": "bedroom"}), ("pick_up", CUP)],
            'action "a3": pick_up breaks "robot before it": the red cup is 3.2 m away',
        ),
        (
            [*FETCH, ("navigate_to", {"place": "entrance"}),
             ("place", {"destination": "entrance", "relation": "on"})],
            "there is nothing at the entrance to put things on",
        ),
        ([("look_at", {"object": "bottle"})], "the bottle has not been seen"),
        (
            [("navigate_to", {"x_m": 3.9, "y_m": 5.5})],
            'navigate_to breaks "area allowed": the point 3.9, 5.5 m is in the pet_corner: the cat',
        ),
        (
            [("navigate_to", {"x_m": 3.9, "y_m": 4.5, "yaw_rad": 1.57}),
             ("move", {"distance_m": 1.0})],
            'action "a2": move breaks "area allowed": the way of 1 m is in the pet_corner',
        ),
    ],
)  # fmt: skip
def test_each_broken_rule_is_named_with_action_and_value(
    butler: World, steps: list[tuple[str, dict[str, Any]]], broken: str
) -> None:
    found = faults(butler, *steps, scene=seen(thing("cup_1"), thing("ball_1", 2.3), BOX))
    assert len(found) == 1
    assert broken in found[0]


@pytest.mark.parametrize(
    ("robot", "size_m", "bottom_m", "grasp", "why"),
    [
        ("butler", (0.06, 0.06, 0.18), 0.75, {}, ""),
        ("butler", (0.06, 0.06, 0.18), 0.75, {"grasp": "side"}, ""),
        ("butler", (0.06, 0.06, 0.18), 0.75, {"grasp": "top"}, "0.88 m"),
        ("butler", (0.06, 0.06, 0.18), 0.80, {}, "0.93 m"),
        ("butler", (0.06, 0.06, 0.06), 0.5, {"grasp": "side"}, "60 mm high"),
        ("so101", (0.04, 0.04, 0.1), 0.0, {"grasp": "side"}, "takes an arm of six joints"),
    ],
)
def test_what_is_too_high_from_above_is_taken_from_the_side_if_it_stands_and_is_round(
    robot: str,
    size_m: tuple[float, float, float],
    bottom_m: float,
    grasp: dict[str, str],
    why: str,
) -> None:
    position_m = (2.0, 1.5, bottom_m + size_m[2] / 2)
    bottle = thing("bottle_1", size_m=size_m, position_m=position_m)
    found = faults(
        world_of(load_robot(robot), EMPTY),
        ("navigate_to", {"object": "bottle_1"}),
        ("pick_up", {"object": "bottle_1", **grasp}),
        scene=seen(bottle),
    )
    graspable = [one for one in found if "graspable" in one]
    assert len(graspable) == bool(why)
    assert why in "".join(graspable)


def test_a_third_thing_needs_a_third_hand(butler: World) -> None:
    scene = seen(thing("cup_1"), thing("ball_1", 2.2), thing("can_1", 2.4))
    (fault,) = faults(
        butler, *(("pick_up", {"object": one}) for one in ("cup_1", "ball_1", "can_1")), scene=scene
    )
    assert '"a3": pick_up breaks "hand free": no hand is free (a hand: cup_1' in fault


def test_what_is_put_down_with_two_hands_full_must_be_named(butler: World) -> None:
    scene = seen(thing("cup_1"), thing("ball_1", 2.2))
    picks = (
        ("pick_up", {"object": "cup_1", "arm": "left"}),
        ("pick_up", {"object": "ball_1", "arm": "right"}),
        ("navigate_to", {"place": "coffee_table"}),
    )
    on_table = {"destination": "coffee_table", "relation": "on"}
    (fault,) = faults(butler, *picks, ("place", on_table), scene=scene)
    assert '"hand named"' in fault
    assert faults(butler, *picks, ("place", {**on_table, "arm": "right"}), scene=scene) == []


@pytest.mark.parametrize(
    ("changes", "rule"),
    [
        ({"size_m": (0.12, 0.12, 0.2)}, "graspable"),
        ({"position_m": (2.0, 1.5, 1.4)}, "graspable"),
        ({"kind": "book", "size_m": (0.3, 0.06, 0.2)}, "payload"),
    ],
)
def test_what_is_too_wide_too_high_or_too_heavy_is_not_taken(
    butler: World, changes: dict[str, Any], rule: str
) -> None:
    found = faults(butler, ("pick_up", {"object": "cup_1"}), scene=seen(thing("cup_1", **changes)))
    assert [one for one in found if f'breaks "{rule}"' in one]


def test_what_lies_deep_in_a_zone_is_out_of_bounds(butler: World) -> None:
    wide = replace(
        butler,
        zones=(
            replace(butler.zones[0], polygon_m=((0.0, 0.0), (8.0, 0.0), (8.0, 1.8), (0.0, 1.8))),
        ),
    )
    found = faults(wide, ("navigate_to", {"object": "cup_1"}), scene=seen(thing("cup_1", 2.0, 0.9)))
    assert "the cup_1 is in the pet_corner" in found[0]


@pytest.mark.parametrize(
    ("step", "what"),
    [
        (("navigate_to", {"x_m": 4.1, "y_m": 2.0}), "the point 4.1, 2 m"),
        (("navigate_to", {"place": "kitchen"}), "the kitchen"),
        (("navigate_to", {"object": "box_1"}), "the box_1"),
        (("move", {"distance_m": 2.5}), "the way of 2.5 m"),
    ],
)
def test_beyond_the_bounds_of_the_map_the_robot_is_not_sent(
    butler: World, step: tuple[str, dict[str, Any]], what: str
) -> None:
    bounds = replace(butler.bounds, map_bounds_m=(0.0, 0.0, 4.0, 4.0))
    found = symbolic_faults(chain(step), replace(butler, bounds=bounds), seen(BOX), HERE)
    assert [f"{what} is outside of x 0 to 4 m, y 0 to 4 m" in one for one in found] == [True]


def test_hands_of_which_nobody_knows_are_not_judged(butler: World) -> None:
    dark = replace(butler, holding={})
    assert symbolic_faults(chain(("place", INTO_BOX)), dark) == []


def test_a_hand_that_holds_something_before_the_plan_counts(butler: World) -> None:
    full = replace(butler, holding={"left": "cup", "right": "ball"})
    assert '"hand free"' in symbolic_faults(chain(("pick_up", CUP)), full)[0]
    assert '"nothing dropped"' in symbolic_faults(chain(("open_gripper", {"arm": "left"})), full)[0]
    assert symbolic_faults(chain(("place", {**INTO_BOX, "arm": "left"})), full) == []


def test_a_plan_is_bounded_in_actions_and_time(butler: World) -> None:
    many = chain(*[("turn", {"angle_rad": 1.0})] * 61)
    assert bounds_faults(many, butler) == ["it has 61 actions, 60 at most"]
    long = chain(*[("wait", {"duration_s": 600})] * 7)
    assert bounds_faults(long, butler) == ["it would take 4200 s, 3600 s at most"]


def action(name: str, skill: str, *after: str, **changes: object) -> Action:
    return Action(id=name, skill=skill, depends_on=after, **changes)


def ordered(*actions: Action) -> dict[str, tuple[str, ...]]:
    return {one.id: one.earlier for one in in_turn(actions)}


def test_what_shares_nothing_runs_side_by_side() -> None:
    assert ordered(action("a", "navigate_to"), action("b", "speak")) == {"a": (), "b": ()}
    left = action("a", "open_gripper", parameters={"arm": "left"})
    right = action("b", "open_gripper", parameters={"arm": "right"})
    assert ordered(left, right) == {"a": (), "b": ()}
    assert ordered(left, action("c", "close_gripper")) == {"a": (), "c": ("a",)}


def test_an_order_by_way_of_a_third_is_an_order() -> None:
    three = (action("a", "turn"), action("s", "speak", "a"), action("b", "turn", "s"))
    assert ordered(*three) == {"a": (), "s": ("a",), "b": ("s",)}


def test_unordered_actions_are_put_in_turn_by_priority() -> None:
    actions = (
        action("a", "turn"),
        action("b", "move"),
        action("c", "stop", priority=1),
        action("s", "speak"),
    )
    assert ordered(*actions) == {
        "c": (),
        "a": ("c",),
        "b": ("a",),
        "s": (),
    }


def test_every_skill_of_the_catalogue_has_its_logic() -> None:
    assert set(LOGIC) == set(SKILLS)
