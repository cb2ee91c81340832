from pathlib import Path
from typing import Any

import pytest

from sim_twin.errors import FaultRefused
from sim_twin.faults import Component, Fault
from sim_twin.faults.scenario import load_scenario, parse_scenario, scenario_paths
from sim_twin.faults.table import EFFECTS
from vla_deploy.robots import load_robot
from vla_deploy.safety import Cause

ROBOT = load_robot("butler")
SCENARIOS = [load_scenario(path, ROBOT) for path in scenario_paths()]
NOT_REHEARSED = {
    *(Component.MICROPHONE, Component.SPEAKER, Component.BATTERY),
    *(Component.BROKER, Component.HOME_DEVICE),
}
"""Control stops for none of them: sound, battery and home have tests of their own."""


def raw(**changes: Any) -> dict[str, Any]:
    fault = {"component": "servo", "instance": 3, "fault": "off", "duration_s": 1.0}
    whole: dict[str, Any] = {
        "summary": "a test",
        "meanwhile": "hold",
        "faults": [fault],
        "expect": {"cause": "servo_bus_lost", "within_s": 0.1},
    }
    return whole | changes


def test_every_fault_of_the_vocabulary_has_a_scenario() -> None:
    assert {fault.fault for scenario in SCENARIOS for fault in scenario.faults} == set(Fault)


def test_every_supported_combination_has_a_scenario() -> None:
    rehearsed = {
        (fault.component, fault.of or fault.fault)
        for scenario in SCENARIOS
        for fault in scenario.faults
    }
    wanted = {row for row in EFFECTS if row[0] not in NOT_REHEARSED}
    assert wanted - rehearsed == set()


def test_every_scenario_expects_a_cause_that_control_knows() -> None:
    assert {scenario.expect.cause for scenario in SCENARIOS} <= {cause.value for cause in Cause}


def test_times_count_from_the_first_fault_to_the_end_of_the_last() -> None:
    fault = {"component": "servo", "instance": 3, "fault": "off"}
    faults = [
        {**fault, "start_s": 0.5, "duration_s": 1.0},
        {**fault, "instance": 4, "start_s": 0.2, "duration_s": 0.1},
    ]
    scenario = parse_scenario("two", raw(faults=faults), ROBOT)
    assert (scenario.begin_s, scenario.end_s) == (0.2, 1.5)


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"music": "loud"}, "music: unknown; expected expect, faults"),
        ({"meanwhile": "dance"}, "meanwhile: expected one of hold, reach"),
        ({"faults": []}, "faults: expected at least one"),
        ({"faults": [{"component": "servo", "fault": "echo"}]}, "it supports off"),
        (
            {"faults": [{"component": "imu", "fault": "off"}]},
            "imu: off: duration_s: a scenario's faults must end",
        ),
        ({"expect": {}}, "expect.cause: missing"),
        ({"expect": {"cause": "none", "mood": 1}}, "expect.mood: unknown; expected of cause"),
        ({"expect": {"cause": "none", "within_s": -1}}, "expect.within_s: cannot be -1"),
        ({"expect": {"cause": "none", "recovery": ["kick"]}}, "expect.recovery: cannot be"),
        ({"expect": {"cause": "none", "torque": "some"}}, "expect.torque: cannot be 'some'"),
    ],
)
def test_a_faulty_scenario_is_refused_with_its_place(changes: dict[str, Any], reason: str) -> None:
    with pytest.raises(FaultRefused, match=reason):
        parse_scenario("bad", raw(**changes), ROBOT)


@pytest.mark.parametrize("text", ["summary = ", "[[faults"])
def test_a_file_that_is_no_toml_is_refused_by_its_path(tmp_path: Path, text: str) -> None:
    path = tmp_path / "broken.toml"
    path.write_text(text)
    with pytest.raises(FaultRefused, match=r"broken\.toml: "):
        load_scenario(path, ROBOT)


def test_a_file_that_is_not_there_is_refused_by_its_path(tmp_path: Path) -> None:
    with pytest.raises(FaultRefused, match=r"none\.toml"):
        load_scenario(tmp_path / "none.toml", ROBOT)
