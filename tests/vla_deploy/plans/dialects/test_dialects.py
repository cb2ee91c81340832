import json
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vla_deploy.plans.dialects import parse_plan, read_plan
from vla_deploy.plans.errors import PlanInvalid
from vla_deploy.plans.plan import ExecutionOptions, dependency_faults

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
TERSE_STEP = [{"action": "wait", "params": {"duration": 1.0}}]
NESTED: list[object] = []
for _ in range(20):
    NESTED = [NESTED]


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
    ("document", "words"),
    [
        ("no json here", "no JSON object found"),
        ("{broken", "no JSON object found"),
        (7, "a plan is a JSON object or a list of actions, got 7"),
        ([{"action": "wait", "duration": 1}] * 500, "the plan has 500 actions, 100 at most"),
        ({"actions": [{"action": "speak", "text": NESTED}]}, "nested too deeply"),
        ({"actions": [{"action": "speak", "text": [0] * 30_000}]}, "the plan is too long"),
        ({"actions": [{"action": "speak", "text": "\ud800"}]}, "characters that are none"),
        ({"actions": [], "options": {"safety_check": False}},
         "options.safety_check must be true: the checks of a plan are never switched off; got "
         "false, leave it out"),
        ({"actions": [], "execution_options": {"max_retries": 50}},
         "execution_options.max_retries: Input should be less than or equal to 10; got 50"),
        ({"actions": [], "options": {"speed": 1}}, "options.speed: Extra inputs are not permitted"),
        ({"actions": [], "options": "fast"}, 'options must be an object such as {"continue_on'),
        ({"actions": [], "feasible": "perhaps"}, 'feasible: Input should be a valid boolean'),
        ({"subtasks": [{"name": "get", "required_primitives": ["pick"]}]},
         "subtask 1 must be an object with a list of actions"),
    ],
    ids=range(13),
)  # fmt: skip
def test_what_is_no_plan_is_refused_in_one_line(document: object, words: str) -> None:
    with pytest.raises(PlanInvalid) as refused:
        parse_plan(document)  # type: ignore[arg-type]
    assert [words in fault for fault in refused.value.faults] == [True]
    assert "\n" not in str(refused.value)


def test_the_whole_request_of_an_action_executor_is_read_as_it_is_written() -> None:
    reading = read_plan(
        {
            "action_sequence": [
                {"id": "nav_001", "type": "navigation", "action": "navigate_to",
                 "parameters": {"location": [2.0, 1.0, 0.0]}, "dependencies": []},
                {"id": "manip_001", "type": "manipulation", "action": "pick_up",
                 "parameters": {"object": "red_cup"}, "dependencies": ["nav_001"]},
                {"id": "nav_002", "type": "navigation", "action": "navigate_to",
                 "parameters": {"location": [0.0, 0.0, 0.0]}, "dependencies": ["manip_001"]},
            ],
            "robot_capabilities": ["navigation", "manipulation"],
            "environment_context": {"map_bounds": [-10, -10, 10, 10]},
            "execution_options": {"continue_on_error": True, "max_retries": 3,
                                  "safety_check": True},
        }
    )  # fmt: skip
    plan = reading.plan
    assert [(one.id, one.skill, one.depends_on) for one in plan.actions] == [
        ("nav_001", "navigate_to", ()),
        ("manip_001", "pick_up", ("nav_001",)),
        ("nav_002", "navigate_to", ("manip_001",)),
    ]
    assert plan.options == ExecutionOptions(continue_on_error=True, max_retries=3)
    assert [one.key for one in reading.notes] == ["robot_capabilities", "environment_context"]
    assert plan.notes == tuple(map(str, reading.notes))


@pytest.mark.parametrize(
    ("document", "goal", "keys"),
    [
        ({"original_command": {"original_command": "bring it", "timestamp": 1.0},
          "action_sequence": [{"action_type": "stop"}], "timestamp": 2.0}, "bring it", "timestamp"),
        ({"goal": "tidy", "summary": "s", "feasible": True, "reasoning": "r", "actions": TERSE_STEP,
          "expected_duration": 20, "safety_concerns": [], "success_criteria": "it is tidy"},
         "tidy", "expected_duration"),
        ({"can_recover": True, "failure_reason": "slipped", "recovery_description": "again",
          "recovery_actions": TERSE_STEP}, "unnamed goal", "failure_reason recovery_description"),
        ({"action": "stop", "params": {}}, "unnamed goal", ""),
        ({"goal": "tidy", "plan": {"steps": TERSE_STEP}}, "tidy", ""),
        ({"goal": "tidy", "actions": TERSE_STEP, "mood\n": "good"}, "tidy", "mood\n"),
        ({"goal": "x", "plan": {"goal": "tidy", "steps": TERSE_STEP}}, "tidy",
         "goal around the plan"),
        ({"goal": "tidy", "actions": [], "steps": TERSE_STEP, "subtasks": TERSE_STEP,
          "options": {}, "execution_options": {"max_retries": 2}, "command": "go"}, "tidy",
         "subtasks execution_options command"),
        ({"can_recover": True, "feasible": False, "actions": TERSE_STEP}, "unnamed goal",
         "can_recover"),
    ],
    ids=["sequence", "terse", "recovery", "one action", "wrapped", "unknown key", "goal twice",
         "lists twice", "feasible twice"],
)  # fmt: skip
def test_the_keys_of_a_plan_are_taken_or_noted(
    document: dict[str, object], goal: str, keys: str
) -> None:
    reading = read_plan(document)
    assert (reading.plan.goal, len(reading.plan.actions)) == (goal, 1)
    assert " ".join(one.key for one in reading.notes) == keys
    assert all("\n" not in str(one) for one in reading.notes)
    wanted = ("it is tidy",) if "success_criteria" in document else ()
    assert reading.plan.success_criteria == wanted


def stops(*given: dict[str, object]) -> list[dict[str, object]]:
    return [{"id": name, "action": "stop", **one} for name, one in zip("abc", given, strict=True)]


@pytest.mark.parametrize(
    ("actions", "goes_on", "order"),
    [
        (stops({}, {}, {}), False, "a b<a c<b"),
        (stops({}, {}, {}), True, "a b~a c~b"),
        (stops({"priority": 30}, {"priority": 1}, {"priority": 2}), False, "b c<b a<c"),
        (stops({"priority": "low"}, {"priority": 1}, {}), False, "a b<a c<b"),
        (stops({"priority": 2, "dependencies": []}, {"priority": 1}, {"priority": 3}), True,
         "a b~a c~b"),
        (stops({}, {"dependencies": []}, {"dependencies": ["a"]}), False, "a b c<a"),
        (stops({"dependencies": ["b"]}, {}, {}), False, "a<b b c<b"),
        (stops({"dependencies": "c"}, {"after": ["a"]}, {}), False, "a<c b~a c"),
    ],
    ids=range(8),
)  # fmt: skip
def test_actions_without_dependencies_come_one_after_the_other(
    actions: list[dict[str, object]], goes_on: bool, order: str
) -> None:
    plan = parse_plan({"actions": actions, "options": {"continue_on_error": goes_on}})
    told = [
        one.id + "".join(f"<{name}" for name in one.depends_on)
        + "".join(f"~{name}" for name in one.after)
        for one in plan.actions
    ]  # fmt: skip
    assert " ".join(told) == order
    assert dependency_faults(plan.actions) == []


def test_what_comes_first_of_an_action_takes_over_what_it_waits_for() -> None:
    where = {"object": "box", "search_area": "kitchen"}
    search = {"id": "b", "action": "find_object", "params": where, "priority": 7}
    plan = parse_plan([{"id": "b_navigate_to", "action": "stop"}, search, {"action": "stop"}])
    assert [(one.id, one.depends_on, one.priority) for one in plan.actions] == [
        ("b_navigate_to", (), 2),
        ("b_navigate_to_2", ("b_navigate_to",), 7),
        ("b", ("b_navigate_to_2",), 7),
        ("a3", ("b",), 2),
    ]


def test_subtasks_become_actions_in_their_order() -> None:
    get = {"name": "get", "description": "take it", "status": "pending", "actions": TERSE_STEP * 2}
    put = {"name": "put", "dependencies": "get", "success_criteria": "it stands there",
           "actions": TERSE_STEP}  # fmt: skip
    show = {"name": "show", "success_criteria": ["seen"], "actions": TERSE_STEP}
    document = {"goal": "g", "subtasks": [get, show, put]}
    reading = read_plan(document)
    assert [(one.id, one.depends_on, one.description) for one in reading.plan.actions] == [
        ("get_1", (), "take it"),
        ("get_2", ("get_1",), "take it"),
        ("show_1", ("get_2",), ""),
        ("put_1", ("get_2",), ""),
    ]
    assert reading.plan.success_criteria == ("seen", "it stands there")
    assert [one.key for one in reading.notes] == ["get.status"]
    going_on = parse_plan({**document, "options": {"continue_on_error": True}})
    assert [(one.depends_on, one.after) for one in going_on.actions] == [
        ((), ()), ((), ("get_1",)), ((), ("get_2",)), (("get_2",), ())
    ]  # fmt: skip


def test_all_faults_of_a_plan_are_told_at_once() -> None:
    with pytest.raises(PlanInvalid) as refused:
        parse_plan([{"action": "turn", "angle": "x"}, 5, {"action": "stop", "priority": "now"}])
    assert [fault[:11] for fault in refused.value.faults] == [
        f'action "a{number}"' for number in (1, 2, 3)
    ]


def test_a_plan_carries_as_many_notes_as_its_message_holds() -> None:
    action = {"action": "pick_up", "params": {"object": "cup", "grasp_type": "pinch"}}
    reading = read_plan([action] * 90)
    assert len(reading.notes) == 90
    assert sum(map(len, reading.plan.notes)) < 3_200
    assert reading.plan.notes[-1].endswith("see: vla-deploy check --plan")


# Of each type of JSON some, alone and within others: what a document holds matters, not how much.
SCALARS = [None, True, 0, -1, 7.5, math.nan, math.inf, "", "x", "pick_up", "\ud800", "ab " * 99]
ANYTHING = st.sampled_from(
    [*SCALARS, [], {}, *([one] for one in SCALARS), *({"skill": one} for one in SCALARS),
     [[["deep"]]], {"parameters": {"object": {"object": []}}}]
)  # fmt: skip


@given(
    st.dictionaries(
        st.sampled_from(
            ["actions", "steps", "goal", "feasible", "summary", "plan", "subtasks", "options"]
        ),
        ANYTHING
        | st.lists(
            st.dictionaries(
                st.sampled_from(
                    [
                        "id",
                        "action",
                        "params",
                        "type",
                        "depends_on",
                        "priority",
                        "actions",
                        "name",
                        "effects",
                        "object",
                        "location",
                        "after",
                        "duration",
                    ]
                ),
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
