"""Each action that other planners and older tools write becomes skills, or is refused by name.

The rows have the keys and shapes of those documents; the values are of this robot's home.
"""

import math
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vla_deploy.gateways.ros.outward.plan_dialects import ranked_actions, terse_plan
from vla_deploy.plans.dialects import parse_plan, read_plan
from vla_deploy.plans.dialects.forms import FORMS
from vla_deploy.plans.errors import PlanInvalid
from vla_deploy.plans.plan import Action, Plan, chained

Json = dict[str, Any]
QUARTER = math.pi / 2


def typed(kind: str, action: str, **parameters: object) -> Json:
    return {"id": "x", "type": kind, "action": action, "parameters": parameters, "dependencies": []}


def ranked(action: str, **parameters: object) -> Json:
    return {"action_type": action, "parameters": parameters, "priority": 1,
            "estimated_duration": 8.0, "feasibility_score": 0.9}  # fmt: skip


def terse(action: str, **params: object) -> Json:
    return {"action": action, "params": params, "description": "what this does"}


def task(kind: str, **parameters: object) -> Json:
    return {"id": "task_0001", "type": kind, "description": "a task", "parameters": parameters,
            "priority": "HIGH", "dependencies": None}  # fmt: skip


# The action as it is written; the skills that it becomes; the keys of which a note tells.
ROWS: list[tuple[Json, list[tuple[str, Json]], str]] = [
    # --- by kind and name ---------------------------------------------------------------------
    (typed("navigation", "navigate_to", location=[2.0, 1.0, 0.0]),
     [("navigate_to", {"x_m": 2.0, "y_m": 1.0})], ""),
    (typed("navigation", "go_to", destination={"x": 2.0, "y": 1.0, "z": 0.0}),
     [("navigate_to", {"x_m": 2.0, "y_m": 1.0})], ""),
    (typed("navigation", "go_to", destination=[2.0, 1.0]),
     [("navigate_to", {"x_m": 2.0, "y_m": 1.0})], ""),
    (typed("navigation", "navigate_to", location=[2.0, 1.5, 0.8]),
     [("navigate_to", {"x_m": 2.0, "y_m": 1.5})], "location"),
    (typed("navigation", "move_forward", distance=1.5), [("move", {"distance_m": 1.5})], ""),
    (typed("navigation", "turn", angle=-90.0), [("turn", {"angle_rad": -QUARTER})], ""),
    (typed("movement", "move_backward", distance=2.0), [("move", {"distance_m": -2.0})], ""),
    (typed("movement", "move_forward"), [("move", {"distance_m": 1.0})], "move_forward"),
    (typed("movement", "turn_left", angle=90), [("turn", {"angle_rad": QUARTER})], ""),
    (typed("movement", "turn_right", angle=90.0), [("turn", {"angle_rad": -QUARTER})], ""),
    (typed("movement", "turn_right"), [("turn", {"angle_rad": -QUARTER})], "turn_right"),
    (typed("movement", "stop"), [("stop", {})], ""),
    (typed("manipulation", "pick_up", object="red_cup"), [("pick_up", {"object": "red cup"})], ""),
    (typed("manipulation", "grasp", object="cup_1"), [("pick_up", {"object": "cup_1"})], ""),
    (typed("manipulation", "put_down", object="red_cup", location="box"),
     [("place", {"object": "red cup", "destination": "box"})], ""),
    (typed("manipulation", "release", object="red_cup"), [("place", {"object": "red cup"})], ""),
    (typed("manipulation", "place", object="red_cup", location="kitchen table"),
     [("place", {"object": "red cup", "destination": "kitchen table"})], ""),
    (typed("interaction", "turn_on", device="lamp"), [("turn_on", {"device": "lamp"})], ""),
    (typed("interaction", "activate", device="lamp"), [("turn_on", {"device": "lamp"})], ""),
    (typed("interaction", "turn_off", device="lamp"), [("turn_off", {"device": "lamp"})], ""),
    (typed("interaction", "deactivate", device="lamp"), [("turn_off", {"device": "lamp"})], ""),
    (typed("perception", "detect_object", object="blue_ball", search_area="current_view"),
     [("find_object", {"object": "blue ball"})], "search_area"),
    (typed("perception", "find_object", object="keys"), [("find_object", {"object": "keys"})], ""),
    # --- by rank ------------------------------------------------------------------------------
    (ranked("find_object", object_type="red_cube", search_area="kitchen"),
     [("navigate_to", {"place": "kitchen"}), ("find_object", {"object": "red cube"})],
     "search_area"),
    (ranked("find_object", object_type="cup", search_area="current_location"),
     [("find_object", {"object": "cup"})], "search_area"),
    (ranked("find_object", object_type="cup", search_method="systematic_scan",
            max_search_time=10.0),
     [("find_object", {"object": "cup"})], "search_method max_search_time"),
    (ranked("navigate_to", target_position=[1.5, 2.0, 0.0], approach_direction="front"),
     [("navigate_to", {"x_m": 1.5, "y_m": 2.0})], "approach_direction"),
    (ranked("navigate_to", target_position=[1.5, 2.0, 0.0], safety_margin=0.5),
     [("navigate_to", {"x_m": 1.5, "y_m": 2.0})], "safety_margin"),
    (ranked("navigate_to", target_position="kitchen"), [("navigate_to", {"place": "kitchen"})], ""),
    (ranked("navigate_to", target_position="there"), [("navigate_to", {"place": "there"})], ""),
    (ranked("move_to", target_position=[1.0, 1.0, 0.0]),
     [("navigate_to", {"x_m": 1.0, "y_m": 1.0})], ""),
    (ranked("pick_up", target_object="red_cup", grasp_type="pinch_grasp",
            grasp_position=[2.5, 1.8, 0.2]),
     [("pick_up", {"object": "red cup"})], "grasp_type grasp_position"),
    *((ranked("take", target_object="cup", grasp_type=how),
       [("pick_up", {"object": "cup"})], "grasp_type")
      for how in ("pinch", "power", "precision")),
    *((ranked("take", target_object="cup", **said),
       [("pick_up", {"object": "cup", **taken})], noted) for said, taken, noted in (
        ({"grasp_type": "top_down"}, {"grasp": "top"}, ""),
        ({"grasp_type": "cylindrical_grasp"}, {"grasp": "side"}, ""),
        ({"approach_direction": "front"}, {"grasp": "side"}, "approach_direction"),
        ({"approach_direction": "top", "careful": True}, {"grasp": "top", "careful": True}, ""),
        ({"force": "low", "speed": 0.1}, {"force_ratio": 0.6, "speed_ratio": 0.3}, "force speed"),
        ({"force": 0.8, "speed": "normal"}, {"force_ratio": 0.8}, "speed"),
        ({"force": 5.0, "speed": 1.5}, {"speed_ratio": 1.0}, "force speed"))),
    (ranked("grasp", target_object="it"), [("pick_up", {"object": "it"})], ""),
    (ranked("pick_up", target_object="cup", object_descriptor="big"),
     [("pick_up", {"object": "big cup"})], ""),
    (ranked("pick_up", object_descriptor="red"), [("pick_up", {"object": "red one"})], ""),
    (ranked("place_down", destination="coffee_table", placement_type="precise"),
     [("place", {"destination": "coffee table"})], "placement_type"),
    (ranked("place_down", target_position=[1.0, 2.0, 0.4], destination="box", placement_type="in"),
     [("place", {"destination": "box", "relation": "in"})], "target_position"),
    (ranked("inspect", target_object="box", inspection_type="visual"),
     [("inspect", {"object": "box"})], "inspection_type"),
    (ranked("look_at", target_object="red_cup"), [("look_at", {"object": "red cup"})], ""),
    (ranked("speak", text_to_speak="Here you are"), [("speak", {"text": "Here you are"})], ""),
    (ranked("listen", duration=10.0), [("wait", {"duration_s": 10.0})], "listen"),
    # --- by name and description --------------------------------------------------------------
    (terse("navigate", destination="living_room", speed=0.3),
     [("navigate_to", {"place": "living room", "speed_m_s": 0.3})], ""),
    (terse("navigate", destination="kitchen", speed="slow"),
     [("navigate_to", {"place": "kitchen", "speed_m_s": 0.15})], "speed"),
    (terse("navigate", destination="kitchen", speed="normal"),
     [("navigate_to", {"place": "kitchen"})], "speed"),
    (terse("pick", object="red_cup", grasp_type="power"),
     [("pick_up", {"object": "red cup"})], "grasp_type"),
    (terse("place", location="kitchen_table", careful=True),
     [("place", {"destination": "kitchen table"})], "careful"),
    (terse("place", location="here"), [("place", {"destination": "here"})], ""),
    (terse("look_at", target="forward"), [("look_at", {"direction": "ahead"})], ""),
    (terse("look_at", target="red cup"), [("look_at", {"object": "red cup"})], ""),
    (terse("open_gripper"), [("open_gripper", {})], ""),
    (terse("close_gripper", force=10.0), [("close_gripper", {})], "force"),
    (terse("move_arm", pose="tuck", speed=0.5), [("move_arm", {"pose": "tuck"})], "speed"),
    (terse("wait", duration=3.0), [("wait", {"duration_s": 3.0})], ""),
    (terse("speak", message="Done"), [("speak", {"text": "Done"})], ""),
    ({"action_type": "pick", "parameters": {"object": "cup"}, "estimated_duration": 5.0,
      "preconditions": ["gripper_empty"], "effects": ["holding(object)"], "status": "pending"},
     [("pick_up", {"object": "cup"})], "status preconditions effects"),
    ({"action": "pick_up", "params": {"object": "cup"}, "required_resources": ["left_arm"],
      "success_criteria": ["holding_cup"], "resolution_notes": "'it' is the cup"},
     [("pick_up", {"object": "cup"})], "success_criteria required_resources"),
    # --- tasks --------------------------------------------------------------------------------
    (task("navigation", target_location="kitchen"), [("navigate_to", {"place": "kitchen"})], ""),
    (task("search_and_navigate", target_object="cup"), [("navigate_to", {"object": "cup"})], ""),
    (task("approach_object", target_object="cup"), [("navigate_to", {"object": "cup"})], ""),
    (task("grasp_object", target_object="cup"), [("pick_up", {"object": "cup"})], ""),
    (task("navigate_to_place", target_location="box", object="cup"),
     [("place", {"destination": "box", "object": "cup"})], ""),
    (task("search_for_object", target_object="cup", search_area=None),
     [("find_object", {"object": "cup"})], ""),
    # --- other ways to say it -----------------------------------------------------------------
    ({"action": "wait", "duration": "2 min"}, [("wait", {"duration_s": 120.0})], ""),
    ({"action": "Move Forward", "distance": "50 cm"}, [("move", {"distance_m": 0.5})], ""),
    ({"action": "turn", "angle_rad": 0.5}, [("turn", {"angle_rad": 0.5})], ""),
    ({"action": "go_to", "pose": [1, 2, 0.5]},
     [("navigate_to", {"x_m": 1.0, "y_m": 2.0, "yaw_rad": 0.5})], ""),
    (task("execute_cleaning", area="kitchen", coverage_type="grid"),
     [("sweep", {"place": "kitchen"})], "coverage_type"),
    (task("watch", area="kitchen", duration="5 min"),
     [("guard", {"place": "kitchen", "duration_s": 300.0})], ""),
    (task("follow", duration=20), [("follow_person", {"duration_s": 20.0})], ""),
    ({"action": "go_to", "location": {"x": 5.0, "y": 2.0, "yaw": 1.57}},
     [("navigate_to", {"x_m": 5.0, "y_m": 2.0, "yaw_rad": pytest.approx(1.57)})], ""),
]  # fmt: skip


@pytest.mark.parametrize(
    ("action", "skills", "noted"), ROWS,
    ids=[f"{row[0].get('action', row[0].get('action_type', row[0].get('type')))}-{at}"
         for at, row in enumerate(ROWS)],
)  # fmt: skip
def test_an_action_as_it_is_written_becomes_skills(
    action: Json, skills: list[tuple[str, Json]], noted: str
) -> None:
    reading = read_plan([action])
    assert [(one.skill, one.parameters) for one in reading.plan.actions] == skills
    assert [note.key for note in reading.notes] == noted.split()
    own = reading.plan.actions[-1]
    assert own.id == action.get("id", "a1")
    assert own.priority == (1 if "priority" in action else 2)
    assert own.estimated_duration_s == action.get("estimated_duration", 0.0)


# The action; words of the one fault.
REFUSALS: list[tuple[Any, str]] = [
    ("go", 'action "a1": expected a JSON object, got "go"'),
    ({}, 'action "a1": it names no action; got no keys, write "action": "pick_up"'),
    ({"action": ["pick_up"]}, 'it names no action; got action ['),
    ({"type": "manipulation"}, 'type "manipulation": this is a kind of action, not one'),
    (task("scan_cleaning_area", scan_radius=3.0, area="kitchen"), "write that alone"),
    (task("plan_cleaning_path", coverage_type="grid", area="kitchen"), "write that alone"),
    ({"action": "turn_left", "action_type": "turn_right"},
     'action "turn_left" and action_type "turn_right" differ; leave one out'),
    (terse("go_to", location=[1]), 'location must be a point [x, y] or [x, y, z], or {"x": ..., '
     '"y": ...}, in m of the map; got [1]'),
    (terse("go_to", location={"x": 1}), "location must be a point"),
    (terse("go_to", location=[1, "two"]), "location must be a point"),
    (terse("go_to", location=5), 'location must be a name such as "kitchen", or a point'),
    (terse("go_to", location="kitchen", destination="bedroom"),
     "location and destination differ; leave one out"),
    (terse("go_to", location="kitchen", speed="backwards"), "speed must be a number of m/s"),
    (terse("go_to", location="kitchen", safety_margin=-0.1),
     "safety_margin must be a number of m, 0 or more; got -0.1"),
    (terse("move_forward", distance=-1), "distance must be more than 0 m; the other way is "
     "move_backward; got -1"),
    (terse("move_forward", distance=math.nan), "distance must be more than 0 m"),
    (terse("move_forward", distance="3 rad"), 'got "3 rad"'),
    (terse("turn_left", angle=-90), "the other way is turn_right; got -90"),
    (terse("turn", angle=True), "angle must be a number of degrees, such as 90; radians are "
     "angle_rad; got true"),
    (terse("pick_up", object=["cup", "ball"]), 'object must be the name of one thing, such as '
     '"red cup"'),
    (terse("place", location=[0.5, 0.5, 0.1]), "location must be furniture or a thing, not a "
     "point: things are put on what is seen; got [0.5, 0.5, 0.1]"),
    (terse("look_at", target=[1, 2, 0.5]), "target must be a thing or one of ahead, left, right"),
    (terse("inspect", target_object="cup", inspection_type="thermal"),
     'inspection_type must be "visual": this robot inspects things with its camera only; '
     'got "thermal"'),
    (terse("grasp", target_object="cup", speed=9.0), "speed must be a share of at most 2"),
    (terse("wait", duration="a while"), 'duration must be a number of s, such as 5 or "2 min"'),
    ({"action": "stop", "params": 3}, 'params must be an object such as {"object": "red cup"}'),
    ({"action": "stop", "params": {}, "parameters": {"a": 1}}, "parameters and params differ"),
    ({"action": "stop", "params": {}, "colour": 1},
     "unknown keys: colour; what the skill takes stands in params"),
    (terse("wait", duration=1, **{"(point)": 5, "duration_s": 2}), "differ; leave one out"),
    ({"action": "stop", "id": "x" * 65}, "its id must be a text of 1 to 64 letters"),
    ({"action": "stop", "id": {"a": 1}}, "its id must be a text"),
    ({"action": "stop", "priority": "urgent"},
     "priority must be a whole number, 1 first, or high, medium, low"),
    ({"action": "stop", "priority": 1.5}, "priority must be a whole number"),
    ({"action": "stop", "estimated_duration": -1}, "estimated_duration must be a number of s"),
    ({"action": "stop", "feasibility_score": 1.1}, "feasibility_score must be a number from 0 to"),
    ({"action": "stop", "dependencies": {"a": 1}}, 'dependencies must be a list of ids, such as'),
    ({"action": "stop", "effects": [1]}, "effects must be a text, or a list of texts"),
]  # fmt: skip


@pytest.mark.parametrize(
    ("action", "words"), REFUSALS, ids=[str(at) for at in range(len(REFUSALS))]
)
def test_what_cannot_be_meant_is_refused_by_name(action: Any, words: str) -> None:
    with pytest.raises(PlanInvalid) as refused:
        parse_plan([action])
    assert len(refused.value.faults) == 1
    assert words in refused.value.faults[0]
    assert refused.value.faults[0].startswith('action "')
    assert "\n" not in str(refused.value)


# Per way in which a value may come, one that no other row has.
SAMPLES: list[Any] = [
    "kitchen", "left", "slow", "in", "visual", 0.7, 12, [1.0, 2.0, 0.3], {"x": 3.0, "y": 4.0},
    True, "7 s",
]  # fmt: skip
FIELDS = ("type", "name", "status", "result", "description", "reason", "resolution_notes",
          "priority", "estimated_duration", "feasibility_score", "required_resources",
          "success_criteria", "dependencies", "preconditions", "effects", "step")  # fmt: skip


@given(st.data())
def test_no_key_of_an_accepted_action_vanishes_without_a_note(data: st.DataObject) -> None:
    name = data.draw(st.sampled_from(sorted(FORMS)))
    names = sorted({key for row in FORMS[name].parameters for key in row.names})
    keys = data.draw(st.lists(st.sampled_from(names), max_size=4, unique=True)) if names else []
    fields = data.draw(st.lists(st.sampled_from(FIELDS), max_size=3, unique=True))
    values = data.draw(st.permutations(SAMPLES))
    params = dict(zip(keys, values, strict=False))
    beside = dict(zip(fields, reversed(values), strict=False))
    if not accepts(name, params, beside):
        return
    reading = read_plan([{"action": name, "params": params, **beside}])
    noted = {note.key for note in reading.notes}
    for key in params.keys() - noted:
        fewer = {one: value for one, value in params.items() if one != key}
        assert not accepts(name, fewer, beside) or plan_of(name, fewer, beside) != reading.plan, key
    for key in beside.keys() - noted:
        less = {one: value for one, value in beside.items() if one != key}
        assert not accepts(name, params, less) or plan_of(name, params, less) != reading.plan, key


def plan_of(name: str, params: Json, beside: Json) -> Plan:
    return parse_plan([{"action": name, "params": params, **beside}])


def accepts(name: str, params: Json, beside: Json) -> bool:
    try:
        plan_of(name, params, beside)
    except PlanInvalid:
        return False
    return True


OWN = chained(
    [
        ("find_object", {"object": "red cup"}),
        ("navigate_to", {"object": "red cup", "speed_m_s": 0.3}),
        ("navigate_to", {"x_m": 1.5, "y_m": -2.0, "yaw_rad": 0.5}),
        ("navigate_to", {"place": "kitchen"}),
        ("pick_up", {"object": "cup_1", "arm": "left"}),
        ("place", {"destination": "box", "relation": "in", "arm": "left"}),
        ("place", {"destination": "red cup", "relation": "next to"}),
        ("hand_over", {"arm": "right"}),
        ("look_at", {"object": "red cup"}),
        ("look_at", {"direction": "left"}),
        ("move", {"distance_m": -0.5}),
        ("turn", {"angle_rad": round(math.radians(-30), 6)}),
        ("open_gripper", {"arm": "left"}),
        ("move_arm", {"pose": "tuck"}),
        ("speak", {"text": "Done_ok"}),
        ("wait", {"duration_s": 3.0}),
        ("stop", {}),
    ]
)


@pytest.mark.parametrize("write", [terse_plan, lambda plan: ranked_actions(plan, where)])
def test_a_plan_that_the_robot_writes_for_others_is_read_as_the_same_plan(write: Any) -> None:
    plan = Plan(goal="all skills", actions=OWN)
    read = parse_plan(write(plan.model_dump(mode="json")))
    assert [told(one) for one in read.actions] == [told(one) for one in OWN]


def told(action: Action) -> tuple[str, Json]:
    """Return an action; a goal may be called a place where it is a thing, as people call both."""
    goal = action.parameters.get("place", action.parameters.get("object"))
    given = {**action.parameters, "object": goal, "place": goal}
    return action.skill, {
        key: round(value, 4) if isinstance(value, float) else value for key, value in given.items()
    }


def where(name: str) -> tuple[float, float, float] | None:
    return None if name == "kitchen" else (1.0, 2.0, 0.4)


def test_the_plan_itself_in_its_own_form_is_read_without_a_note() -> None:
    plan = Plan(goal="all skills", summary="s", safety_concerns=("hot",), actions=OWN)
    assert parse_plan(plan.model_dump(mode="json")) == plan
