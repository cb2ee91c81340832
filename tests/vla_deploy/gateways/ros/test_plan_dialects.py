"""Plans are written as other planning nodes expect them, and read back as the same plan."""

import pytest

from vla_deploy.gateways.ros.outward.plan_dialects import (
    ranked_actions,
    resolved_actions,
    terse_plan,
)

PLACES = {"kitchen": (6.2, 2.2, 0.0), "red cup": (1.8, 1.6, 0.5)}
PLAN = {
    "goal": "fetch the red cup",
    "summary": "manipulation: fetch it",
    "reasoning": '"it" is cup_1 (red cup) (we spoke of it just now); '
    '"the kitchen" is kitchen (its name)',
    "feasible": True,
    "safety_concerns": ["hot"],
    "success_criteria": ["held", "there"],
    "actions": [
        {"id": "b", "skill": "pick_up", "parameters": {"object": "cup_1"}, "depends_on": ["a"]},
        {"id": "a", "skill": "navigate_to", "parameters": {"object": "red cup"}, "depends_on": []},
        {"id": "c", "skill": "navigate_to", "parameters": {"place": "kitchen"}},
        {
            "id": "d",
            "skill": "place",
            "parameters": {"destination": "kitchen", "relation": "on"},
            "depends_on": ["b", "c"],
            "estimated_duration_s": 12.0,
            "feasibility_score": 0.8,
        },
    ],
}


def one(skill, **parameters):
    plan = {"actions": [{"id": "a1", "skill": skill, "parameters": parameters}]}
    (action,) = ranked_actions(plan, PLACES.get)
    return action["action_type"], action["parameters"]


@pytest.mark.parametrize(
    ("skill", "parameters", "expected"),
    [
        (
            *("navigate_to", {"place": "kitchen"}),
            ("navigate_to", {"target_position": [6.2, 2.2, 0.0], "destination": "kitchen"}),
        ),
        (
            *("navigate_to", {"x_m": 1, "y_m": 2, "yaw_rad": 3}),
            ("navigate_to", {"target_position": [1.0, 2.0, 0.0], "yaw": 3.0}),
        ),
        ("navigate_to", {"place": "moon"}, ("navigate_to", {"destination": "moon"})),
        ("move", {"distance_m": -0.5}, ("move_backward", {"distance": 0.5})),
        ("turn", {"angle_rad": -1.5707963267948966}, ("turn_right", {"angle": 90.0})),
        ("find_object", {"object": "keys"}, ("find_object", {"object_type": "keys"})),
        ("look_at", {"direction": "left"}, ("look_at", {"direction": "left"})),
        ("speak", {"text": "hello"}, ("speak", {"text_to_speak": "hello"})),
        ("wait", {"duration_s": 2}, ("wait", {"duration": 2.0})),
        ("open_gripper", {"arm": "left"}, ("open_gripper", {"arm": "left"})),
    ],
)
def test_each_skill_has_its_words(skill, parameters, expected) -> None:
    assert one(skill, **parameters) == expected


def test_priority_is_the_turn_at_which_an_action_can_come() -> None:
    found = ranked_actions(PLAN, PLACES.get)
    assert [action["priority"] for action in found] == [2, 1, 1, 3]
    assert all(type(action["priority"]) is int for action in found)
    assert found[3]["estimated_duration"] == 12.0
    assert found[3]["feasibility_score"] == 0.8


def test_what_was_resolved_is_noted_where_it_is_used() -> None:
    actions, log = resolved_actions(PLAN, PLACES.get)
    notes = [action.get("resolution_notes") for action in actions]
    of_it, of_kitchen = (
        "'it' is cup_1 (red cup): we spoke of it just now",
        "'the kitchen' is kitchen: its name",
    )
    assert notes == [of_it, None, of_kitchen, of_kitchen]
    assert log == [
        f"Action pick_up: {of_it}",
        f"Action navigate_to: {of_kitchen}",
        f"Action place_down: {of_kitchen}",
    ]


def test_a_terse_plan_has_what_a_vision_language_planner_writes() -> None:
    plan = terse_plan(PLAN)
    assert plan["expected_duration"] == 12.0
    assert plan["success_criteria"] == "held; there"
    assert plan["actions"][3] == {
        "action": "place",
        "params": {"location": "kitchen", "relation": "on"},
        "description": "place kitchen on",
    }
