"""Whole plans as other planners write them pass grounding and validation at home."""

from typing import Any

import pytest

from tests.vla_deploy.planning.conftest import Desk
from vla_deploy.planning.interfaces import PlanRequest
from vla_deploy.planning.planner import checked
from vla_deploy.plans.dialects import parse_plan
from vla_deploy.plans.errors import PlanError
from vla_deploy.plans.knowledge import world_of
from vla_deploy.robots import load_robot

REQUEST = PlanRequest(command_id="x", text="", world=world_of(load_robot("butler"), {}))
FETCH = [
    {"id": "nav_001", "type": "navigation", "action": "navigate_to",
     "parameters": {"location": [2.0, 2.0, 0.0]}, "dependencies": []},
    {"id": "manip_001", "type": "manipulation", "action": "pick_up",
     "parameters": {"object": "red_cup"}, "dependencies": ["nav_001"]},
    {"id": "nav_002", "type": "navigation", "action": "navigate_to",
     "parameters": {"location": [0.5, 2.5, 0.0]}, "dependencies": ["manip_001"]},
]  # fmt: skip
STRUCTURED = [
    {"action_type": "navigate_to", "priority": 1, "estimated_duration": 15.0,
     "parameters": {"target_position": [2.2, 2.1, 0.0], "approach_direction": "front",
                    "safety_margin": 0.5}},
    {"action_type": "find_object", "priority": 2, "estimated_duration": 8.0,
     "parameters": {"object_type": "red_cup", "search_method": "systematic_scan",
                    "max_search_time": 10.0}},
    {"action_type": "pick_up", "priority": 3, "estimated_duration": 6.0,
     "parameters": {"target_object": "red_cup", "grasp_type": "pinch_grasp",
                    "grasp_position": [2.5, 1.8, 0.2]}},
    {"action_type": "speak", "priority": 4, "feasibility_score": 0.9, "estimated_duration": 2.0,
     "parameters": {"text_to_speak": "I have it"}},
]  # fmt: skip
SEEN = {
    "goal": "bring the red cup to the kitchen", "summary": "fetch and place it", "feasible": True,
    "reasoning": "it is near", "expected_duration": 60, "safety_concerns": [],
    "success_criteria": "the cup stands in the kitchen",
    "actions": [
        {"action": "navigate", "params": {"destination": "living_room", "speed": 0.3}},
        {"action": "look_at", "params": {"target": "red cup"}, "description": "see it"},
        {"action": "pick", "params": {"object": "red cup", "grasp_type": "top"}},
        {"action": "place", "params": {"location": "kitchen table", "careful": True}},
        {"action": "speak", "params": {"message": "Done"}},
    ],
}  # fmt: skip
CLEAN = [
    {"action_type": "find_object", "priority": 1, "estimated_duration": 8.0,
     "parameters": {"object_type": "trash_bin", "search_area": "kitchen"}},
]  # fmt: skip


@pytest.mark.parametrize(
    ("document", "skills"),
    [
        (FETCH, "navigate_to find_object+ navigate_to+ pick_up navigate_to"),
        (STRUCTURED, "navigate_to find_object navigate_to+ pick_up speak"),
        (SEEN, "navigate_to find_object+ look_at navigate_to+ pick_up navigate_to+ place speak"),
    ],
    ids=["fetch", "structured", "seen"],
)
def test_a_plan_as_it_is_written_may_run(document: Any, skills: str) -> None:
    plan = checked(parse_plan(document), REQUEST)
    told = [f"{one.skill}{'+' * (one.description == 'put in')}" for one in plan.actions]
    assert " ".join(told) == skills


def test_what_the_robot_does_not_know_is_refused_with_the_action() -> None:
    with pytest.raises(PlanError, match='I do not know the object "trash bin"') as refused:
        checked(parse_plan(CLEAN), REQUEST)
    assert refused.value.action_id == "a1"


def test_who_follows_the_command_reads_what_is_not_used(desk: Desk) -> None:
    options = {"continue_on_error": True, "max_retries": 3, "safety_check": True}
    events = desk.answers_to(plan={"action_sequence": STRUCTURED, "execution_options": options})
    (planned,) = [one["plan"] for one in events if one["event"] == "plan"]
    assert planned["options"]["continue_on_error"] is True
    assert [note.split(" ")[:2] for note in planned["notes"]] == [
        ["a1:", "approach_direction"],
        ["a1:", "safety_margin"],
        ["a2:", "search_method"],
        ["a2:", "max_search_time"],
        ["a3:", "grasp_type"],
        ["a3:", "grasp_position"],
    ]
    assert desk.plans()[0]["plan"] == planned


def test_a_plan_that_would_switch_checks_off_is_refused(desk: Desk) -> None:
    options = {"safety_check": False}
    (event,) = desk.answers_to(plan={"action_sequence": FETCH, "execution_options": options})
    assert event["event"] == "rejected"
    assert "never switched off" in event["reason"]
