"""A context document is a scene to check plans in; what is not used of it is noted."""

import pytest

from vla_deploy.plans.dialects import is_context, read_context
from vla_deploy.plans.errors import PlanInvalid
from vla_deploy.plans.knowledge import World
from vla_deploy.robots.plan_bounds import PlanBounds

WORLD = World(
    places={"kitchen": "kitchen"},
    poses=frozenset(),
    holding={},
    bounds=PlanBounds(map_bounds_m=(-50.0, -50.0, 50.0, 8.0)),
)
CONTEXT = {
    "object_locations": {
        "red_cup": [2.0, 1.5, 0.8],
        "blue_ball": {"x": 3.2, "y": -1.0, "z": 0.8},
        "kitchen": [5.0, 0.0, 0.0],
        "unicorn": [1.0, 1.0, 0.0],
    },
    "robot_position": [0.5, 0.25, 0.0],
    "map_bounds": [-10, -10, 10, 10],
    "weather": "fine",
}


@pytest.mark.parametrize("document", [CONTEXT, {"environment_context": CONTEXT, "actions": []}])
def test_things_robot_and_the_narrower_bounds_are_taken(document: dict[str, object]) -> None:
    assert is_context(document)
    context = read_context(document, WORLD)
    things = [(one.colour, one.kind, one.position_m) for one in context.scene.things]
    assert things == [("red", "cup", (2.0, 1.5, 0.8)), ("blue", "ball", (3.2, -1.0, 0.8))]
    robot = context.scene.robot
    assert robot is not None
    assert (robot.x_m, robot.y_m) == (0.5, 0.25)
    assert context.world.bounds.map_bounds_m == (-10.0, -10.0, 10.0, 8.0)
    assert [one.key for one in context.notes] == [
        "weather", "kitchen", "unicorn", "robot_position"
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("document", "words"),
    [
        ({"object_locations": ["cup"]}, "object_locations must be an object"),
        ({"object_locations": {"cup": [1]}}, "object_locations.cup must be a point"),
        ({"robot_position": "here"}, "robot_position must be a point"),
        ({"map_bounds": [1, 2, 3]}, "map_bounds must be [min x, min y, max x, max y] in m"),
        ({"environment_context": 5}, "environment_context must be an object; got 5"),
    ],
)
def test_what_is_no_context_is_refused_by_name(document: dict[str, object], words: str) -> None:
    with pytest.raises(PlanInvalid) as refused:
        read_context(document, WORLD)
    assert [words in fault for fault in refused.value.faults] == [True]
