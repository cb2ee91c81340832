"""Each part of the robot has a level of its own in what diagnostics show."""

import pytest

from vla_deploy.gateways.ros.outward.health import TOPICS, HealthLevel, health_of

WELL = {
    "process_table": {
        "processes": [{"name": "control", "state": "ready", "reason": "", "alarms": []}]
    },
    "control_status": {
        "state": "armed",
        "estop_latched": False,
        "cause": "",
        "detail": "",
        "buses": {
            "servos": {"cycles": 7, "budget": {"bus": "ok", "degraded": [], "lost": []}},
            "can": {"sent": 3, "degraded_nodes": 0, "lost_nodes": 0},
        },
        "joints": {"temperature_c": [30.0, None], "voltage_v": [None]},
    },
    "scene": {"objects": [], "away": {}, "image": {"use": "all"}, "sight": {}, "robot": {}},
    "planner_status": {"away": {}},
    "executor_status": {"state": "idle"},
    "speech_status": {"state": "listening", "voice": {"state": "ready"}},
    "budget": {"rows": [], "ladder": {"taken": []}},
    "budget_stop": {"stop": False},
    "board": {"readings": {"cpu_ratio": 0.5}},
}


def levels(**changes):
    found = health_of(WELL | changes)
    return {one.name: one.level.name for one in found if one.level is not HealthLevel.OK}


def control(**changes):
    return {"control_status": WELL["control_status"] | changes}


def buses(**changes):
    return control(buses=WELL["control_status"]["buses"] | changes)


def test_a_well_robot_has_no_level_but_ok() -> None:
    assert levels() == {}
    assert {one.name for one in health_of(WELL)} >= {"process control", "bus servos", "budgets"}


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        (control(state="stopped", cause="person"), {"control": "WARN"}),
        (control(state="fault", cause="bus"), {"control": "ERROR"}),
        (control(state="stopped", estop_latched=True), {"control": "ERROR"}),
        (control(cause="obstacle_stop_zone"), {"control": "WARN"}),
        (buses(can={"degraded_nodes": 1, "lost_nodes": 0}), {"bus can": "WARN"}),
        (buses(can={"degraded_nodes": 0, "lost_nodes": 1}), {"bus can": "ERROR"}),
        (buses(servos={"budget": {"bus": "degraded", "degraded": [3]}}), {"bus servos": "WARN"}),
        (buses(servos={"budget": {"bus": "ok", "lost": [3]}}), {"bus servos": "ERROR"}),
        (buses(servos={"faults": ["overheating of 3"]}), {"bus servos": "WARN"}),
        (
            {"process_table": {"processes": [{"name": "p", "state": "given up"}]}},
            {"process p": "ERROR"},
        ),
        (
            {"process_table": {"processes": [{"name": "p", "state": "starting"}]}},
            {"process p": "WARN"},
        ),
        (
            {"process_table": {"processes": [{"name": "p", "state": "ready", "alarms": ["old"]}]}},
            {"process p": "WARN"},
        ),
        (
            {"budget": {"rows": [{"over": True, "process": None, "metric": "m", "measured": 1}]}},
            {"budgets": "WARN"},
        ),
        (
            {"budget": {"rows": [], "ladder": {"taken": [{"action": "slow", "process": "p"}]}}},
            {"budgets": "WARN"},
        ),
        ({"budget_stop": {"stop": True, "reason": "too hot"}}, {"budgets": "ERROR"}),
        ({"scene": WELL["scene"] | {"away": {"camera": "gone"}}}, {"perception": "ERROR"}),
        ({"scene": WELL["scene"] | {"robot": None}}, {"perception": "ERROR"}),
        ({"scene": WELL["scene"] | {"image": {"use": "form"}}}, {"perception": "WARN"}),
        ({"planner_status": {"away": {"gist": "no model"}}}, {"planner": "WARN"}),
        ({"executor_status": {"state": "recovering"}}, {"executor": "WARN"}),
        ({"speech_status": {"state": "deaf", "why": "no microphone"}}, {"speech": "WARN"}),
    ],
)
def test_what_is_wrong_shows(changes, expected) -> None:
    assert levels(**changes) == expected


def test_who_is_silent_is_stale() -> None:
    found = health_of(dict.fromkeys(TOPICS))
    assert {one.level for one in found} == {HealthLevel.STALE}
    assert {one.name for one in found} == {
        *("supervisor", "control", "budgets", "perception", "planner", "executor", "speech")
    }
