"""A mission is read from words and from documents, and refused with everything that is wrong."""

from datetime import UTC, datetime
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vla_deploy.missions.errors import MissionInvalid
from vla_deploy.missions.mission import check_mission, mission_from_words, read_mission
from vla_deploy.skills.resources import body_of

NOW = datetime(2026, 5, 4, 15, 30, tzinfo=UTC)


@pytest.mark.parametrize(
    ("said", "expected"),
    [
        ("go to the kitchen and find the cup", None),
        ("go to the kitchen; find the cup; clean the table",
         [("go to the kitchen", ()), ("find the cup", ("o1",)), ("clean the table", ("o2",))]),
        ("go to the kitchen; meanwhile say hello; then come back",
         [("go to the kitchen", ()), ("say hello", ()), ("come back", ("o1", "o2"))]),
        ("Go to the kitchen. Then find the cup.", None),
        ("every ten minutes, go to the kitchen", [("go to the kitchen", ())]),
    ],
)  # fmt: skip
def test_words_become_objectives_in_their_order(said, expected) -> None:
    found = mission_from_words(said, NOW)
    told = found and [(one.words, one.depends_on) for one in found.objectives]
    assert told == expected


@pytest.mark.parametrize(
    ("said", "why"),
    [
        (";".join(["go"] * 51), "at most 50 items"),
        (f"go home in {'9' * 309} seconds", "at_unix_s"),
        (f"{'a' * 1001}; go", "at most 1000 characters"),
    ],
)
def test_words_that_make_no_mission_are_refused(said, why) -> None:
    with pytest.raises(MissionInvalid, match=why):
        mission_from_words(said, NOW)


TASK = {
    "id": "grasp_cup_2", "name": "Grasp cup", "description": "pick up the cup", "priority": 2,
    "dependencies": [], "type": "manipulation", "estimated_duration": 10.0,
    "required_resources": ["left_arm"], "success_criteria": ["holding_cup"],
}  # fmt: skip


@pytest.mark.parametrize(
    "document",
    [
        ["bring the red cup to the living room", "find the keys"],
        {"objectives": ["find the keys"], "schedule": {"every_s": 60}},
        {"goal": "tidy", "tasks": {"grasp_cup_2": TASK}},
        {"objectives": [{"words": "fetch it", "subtasks": ["find the cup", TASK],
                         "priority": "high", "criteria": "the hands are empty"}]},
        {"objectives": [{"actions": [{"id": "a", "skill": "turn",
                                      "parameters": {"angle_rad": 1.0}}]}]},
    ],
)  # fmt: skip
def test_documents_of_several_forms_are_missions(butler, world, document) -> None:
    check_mission(read_mission(document), world, list(body_of(butler)), NOW.timestamp())


def task(**changes: Any) -> dict[str, Any]:
    return {"objectives": [TASK | changes]}


@pytest.mark.parametrize(
    ("document", "why"),
    [
        (7, "expected a JSON object or a list"),
        ({"goal": "x"}, 'expected "objectives"'),
        ([], "objectives: Tuple should have at least 1 item"),
        (["go"] * 51, "at most 50 items"),
        ([{"words": "go", "colour": "red"}], "objective 1 has unknown keys: colour"),
        ([7], "objective 1 is no JSON object: 7"),
        (task(required_resources=["left_arm", "right_arm", "third_arm"]),
         'o?grasp_cup_2.s1 needs "third_arm", which this robot does not have; it has: base'),
        (task(success_criteria=["the moon is in the box"]), "grasp_cup_2.*moon"),
        (task(dependencies=["fetch"]), '"grasp_cup_2" depends on "fetch", which is not there'),
        ([{"id": "a", "words": "go", "depends_on": ["b"]},
          {"id": "b", "words": "go", "depends_on": ["a"]}], "wait for each other: a -> b -> a"),
        ([{"id": "a", "words": "go"}, {"id": "a", "words": "go"}], 'id "a" is used twice'),
        ([{"words": " "}], "expected either words or actions"),
        ({"objectives": ["go"], "schedule": {"at_unix_s": 1.0}}, "s ago; give a time that is to"),
        ({"objectives": ["go"], "schedule": {"every_s": 1.0}}, "schedule.every_s"),
        ([{"words": "x", "subtasks": [["deep"]]}], "subtask 1 is no JSON object"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_named(butler, world, document, why) -> None:
    with pytest.raises(MissionInvalid, match=why):
        check_mission(read_mission(document), world, list(body_of(butler)), NOW.timestamp())


KEYS = st.sampled_from(
    ["objectives", "tasks", "goal", "schedule", "words", "subtasks", "actions", "depends_on", "id",
     "priority", "success_criteria", "required_resources", "at_unix_s", "every_s", "when", "skill",
     "parameters", "x"]
)  # fmt: skip
ANYTHING = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=12),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(KEYS, inner, max_size=5),
    max_leaves=30,
)


@settings(max_examples=300)
@given(document=ANYTHING | st.fixed_dictionaries({"objectives": st.lists(ANYTHING, max_size=4)}))
def test_whatever_a_document_holds_it_is_a_mission_or_refused(butler, world, document) -> None:
    try:
        check_mission(read_mission(document), world, list(body_of(butler)), NOW.timestamp())
    except MissionInvalid as error:
        assert str(error).count("\n") == 0
