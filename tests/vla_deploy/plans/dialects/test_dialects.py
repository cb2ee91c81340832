import json
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vla_deploy.plans.dialects import parse_plan
from vla_deploy.plans.errors import PlanInvalid

TYPED = {
    "goal": "tidy",
    "actions": [
        {"id": 1, "type": "navigation", "action": "go_to", "parameters": {"location": "kitchen"}},
        {
            "id": 2,
            "type": "manipulation",
            "action": "grasp",
            "parameters": {"object_name": "red cup"},
            "dependencies": [1],
        },
    ],
}
RANKED = [
    {"action_type": "navigate_to", "parameters": {"location": "kitchen"}, "priority": 1},
    {"action_type": "pick_up", "parameters": {"object": "red cup"}, "priority": 2},
]
TERSE = {
    "task": "tidy",
    "steps": [
        {"action": "navigate", "params": {"target": "kitchen"}, "description": "go there"},
        {"action": "pick", "params": {"target": "red cup"}, "description": "take it"},
    ],
}


@pytest.mark.parametrize("document", [TYPED, RANKED, TERSE])
def test_every_dialect_becomes_the_same_steps(document: dict[str, object]) -> None:
    plan = parse_plan(document)
    assert [(a.skill, a.parameters) for a in plan.actions] == [
        ("navigate_to", {"place": "kitchen"}),
        ("pick_up", {"object": "red cup"}),
    ]
    assert plan.actions[1].depends_on == (plan.actions[0].id,)


def test_json_wrapped_in_prose_is_found() -> None:
    text = f"Sure! Here is {{my}} plan:\n```json\n{json.dumps(TERSE)}\n```\nGood luck."
    assert len(parse_plan(text).actions) == 2


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ("[" * 60_000, "nested too deeply"),
        ("{" * 60_000, "no JSON"),
        ('{"a": [' * 9_000, "nested too deeply|no JSON"),
    ],
    ids=["lists", "braces", "objects"],
)
def test_text_made_to_cost_time_or_stack_is_refused(text: str, fault: str) -> None:
    with pytest.raises(PlanInvalid, match=fault):
        parse_plan(text)


@pytest.mark.parametrize(
    ("action", "skill", "parameters"),
    [
        ({"action": "turn_right", "params": {"degrees": 90}}, "turn", {"angle_rad": -math.pi / 2}),
        ({"action": "move_backward", "params": {"distance": 1}}, "move", {"distance_m": -1.0}),
        (
            {"action": "navigate_to", "params": {"pose": [1, 2, 0.5]}},
            "navigate_to",
            {"x_m": 1, "y_m": 2, "yaw_rad": 0.5},
        ),
        (
            {"action": "go_to", "params": {"position": {"x": 1, "y": 2}}},
            "navigate_to",
            {"x_m": 1, "y_m": 2},
        ),
        (
            {"action": "put_down", "params": {"object": "cup", "location": "box"}},
            "place",
            {"object": "cup", "destination": "box"},
        ),
    ],
)
def test_dialect_parameters_become_si_and_canonical_names(
    action: dict[str, object], skill: str, parameters: dict[str, object]
) -> None:
    parsed = parse_plan([action]).actions[0]
    assert (parsed.skill, parsed.parameters) == (skill, parameters)


@pytest.mark.parametrize(
    "document",
    [
        "no json here",
        "{broken",
        {"actions": ["go"]},
        {"actions": [{"skill": "x", "parameters": {}, "colour": 1}]},
        7,
    ],
)
def test_garbage_is_refused_by_name(document: object) -> None:
    with pytest.raises(PlanInvalid, match="plan was refused"):
        parse_plan(document)  # type: ignore[arg-type]


# Of each type of JSON some, alone and within others: what a document holds matters, not how much.
SCALARS = [None, True, 0, -1, 7.5, math.nan, math.inf, "", "x", "pick_up", "\ud800", "ab " * 99]
ANYTHING = st.sampled_from(
    [*SCALARS, [], {}, *([one] for one in SCALARS), *({"skill": one} for one in SCALARS),
     [[["deep"]]], {"parameters": {"object": {"object": []}}}]
)  # fmt: skip


@given(
    st.dictionaries(
        st.sampled_from(["actions", "steps", "goal", "feasible", "summary"]),
        ANYTHING
        | st.lists(
            st.dictionaries(
                st.sampled_from(["id", "action", "params", "type", "depends_on", "priority"]),
                ANYTHING,
            ),
            max_size=3,
        ),
    )
)
def test_any_json_is_either_a_plan_or_a_named_refusal(document: dict[str, object]) -> None:
    try:
        assert parse_plan(document).goal
    except PlanInvalid as error:
        assert error.faults
