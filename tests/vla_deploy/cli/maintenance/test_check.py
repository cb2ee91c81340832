"""`vla-deploy check --plan` shows what each action becomes, and refuses in one line."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

PLAN = {
    "action_sequence": [
        {"id": "nav_001", "type": "navigation", "action": "navigate_to",
         "parameters": {"location": [2.2, 2.1, 0.0], "approach_direction": "front"}},
        {"id": "manip_001", "type": "manipulation", "action": "pick_up",
         "parameters": {"object": "red_cup"}, "dependencies": ["nav_001"]},
        {"id": "turn_001", "type": "movement", "action": "turn_left", "parameters": {"angle": 90}},
    ],
    "execution_options": {"continue_on_error": True},
    "map_name": "flat",
}  # fmt: skip
CYCLE = [
    {"id": "a", "action": "stop", "dependencies": ["b"]},
    {"id": "b", "action": "stop", "dependencies": ["a", "gone"]},
]
CONTEXT = {"object_locations": {"red_cup": [4.0, 0.5, 0.5]}, "map_bounds": [0, 0, 3, 3]}


@pytest.fixture
def check(vla: Callable[..., Any], tmp_path: Path) -> Callable[..., Any]:
    """Check a plan, in a scene where one is given."""

    def check(plan: object, *words: str, scene: object = None) -> Any:
        (tmp_path / "plan.json").write_text(plan if isinstance(plan, str) else json.dumps(plan))
        (tmp_path / "scene.json").write_text(json.dumps(scene))
        around = ("--scene", tmp_path / "scene.json") if scene else ()
        return vla("check", "--plan", tmp_path / "plan.json", *around, *words)

    return check


def test_each_action_is_shown_with_its_units_and_what_is_not_used(
    check: Callable[..., Any],
) -> None:
    said = check(PLAN)
    assert said.code == 0
    assert [" ".join(line.split()) for line in said.out.splitlines()[3:]] == [
        'map_name "flat": not used',
        "options: continue_on_error True",
        "nav_001 navigate_to x 2.2 m, y 2.1 m",
        'approach_direction "front": not used, where the robot stands is chosen by the map and by '
        "its reach",
        "manip_001_find_object find_object object red cup (put in)",
        "manip_001_navigate_to navigate_to object red cup (put in)",
        "manip_001 pick_up object red cup",
        "turn_001 turn angle 1.571 rad (90°)",
    ]


def test_as_json_it_has_the_plan_the_notes_and_no_errors(check: Callable[..., Any]) -> None:
    document = check(PLAN, "--json").document
    assert document["success"] is True
    assert [one["skill"] for one in document["plan"]["actions"]][-1] == "turn"
    assert [(one["action_id"], one["key"]) for one in document["notes"]] == [
        ("", "map_name"), ("nav_001", "approach_direction")
    ]  # fmt: skip
    assert document["validation_errors"] == document["dependency_errors"] == []


@pytest.mark.parametrize(
    ("plan", "validation", "dependency"),
    [
        (CYCLE, [], ['action "b" depends on "gone", which is not in the plan',
                     "the dependencies form a cycle: a -> b -> a"]),
        ([{"action": "fly", "params": {}}], ['action "a1": unknown skill "fly"'], []),
        ([{"action": "go_to", "params": {"location": [20, 0, 0]}}],
         ['action "a1": navigate_to breaks "area allowed": the point 20, 0 m is outside of x -10 '
          "to 10 m, y -10 to 10 m, the map_bounds_m in force"], []),
        ([{"action": "go_to", "params": {"location": [2.0, 1.5]}}],
         ['action "a1": navigate_to breaks "area allowed": the map shows no free floor at'], []),
        ([{"action": "move", "params": {"distance": 1, "how": "fast"}}],
         ['action "a1": move has no parameter "how"; it takes: distance_m, speed_m_s'], []),
        ([{"id": "see", "action": "find_object", "params": {"object": "unknown_object"}}],
         ['action "see": I do not know the object "unknown object"'], []),
        ([{"action": "go_to", "params": {"location": "moon"}}],
         ['action "a1": I do not know the place "moon"'], []),
        ([{"action": "speak", "params": {"text": 5}}], ['action "a1": text must be a text'], []),
        ([{"action": "wait", "duration": 1}] * 500, ["the plan has 500 actions, 100 at most"], []),
        ({"anything": {"else": 1}}, ["it has no actions"], []),
    ],
    ids=range(10),
)  # fmt: skip
def test_a_refusal_is_one_line_and_tells_faults_of_actions_from_those_of_their_order(
    check: Callable[..., Any], plan: object, validation: list[str], dependency: list[str]
) -> None:
    said = check(plan, "--json")
    assert said.code == 2
    assert said.err.count("\n") == 1
    assert [len(said.document["validation_errors"]), len(said.document["dependency_errors"])] == [
        len(validation), len(dependency)
    ]  # fmt: skip
    told = [*said.document["validation_errors"], *said.document["dependency_errors"]]
    for fault, words in zip(told, [*validation, *dependency], strict=True):
        assert fault.startswith(words)
        assert fault in said.err


@pytest.mark.parametrize("text", ["[" * 100_000, "{", "[" * 900 + "]" * 900])
def test_a_file_that_holds_no_plan_is_refused_in_one_line(
    check: Callable[..., Any], text: str
) -> None:
    said = check(text)
    assert said.code == 2
    assert said.err.count("\n") == 1
    assert "nested too deeply" in said.err or "is no JSON" in said.err


def test_a_plan_is_checked_in_the_surroundings_of_a_context_document(
    check: Callable[..., Any],
) -> None:
    said = check([{"action": "pick_up", "params": {"object": "red_cup"}}], scene=CONTEXT)
    assert said.code == 2
    assert "the red cup is outside of x 0 to 3 m, y 0 to 3 m" in said.err
    wide = {**CONTEXT, "map_bounds": [-10, -10, 10, 10]}
    assert check([{"action": "pick_up", "params": {"object": "red_cup"}}], scene=wide).code == 0


def test_a_scene_without_a_plan_is_refused(vla: Callable[..., Any]) -> None:
    said = vla("check", "--scene", "scene.json")
    assert said.code == 2
    assert "add --plan FILE" in said.err
