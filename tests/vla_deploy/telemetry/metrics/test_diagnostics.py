"""The metrics as diagnostics of ROS 2: a status for every part, the worst condition its level."""

from typing import TYPE_CHECKING, Any

from vla_deploy.telemetry.metrics.diagnostics import DiagnosticLevel, diagnostics

if TYPE_CHECKING:
    from conftest import Robot

WALL_NS = 1_800_000_000_500_000_000


def told(robot: "Robot") -> dict[str, dict[str, Any]]:
    array = diagnostics(robot.read(), WALL_NS)
    assert array["header"]["stamp"] == {"sec": 1_800_000_000, "nanosec": 500_000_000}
    names = [status["name"] for status in array["status"]]
    assert len(set(names)) == len(names)
    return {status["name"]: status for status in array["status"]}


def test_parts_lie_in_a_hierarchy_below_the_robot_with_texts_alone(whole: "Robot") -> None:
    statuses = told(whole)
    assert {"/butler/Processes/control", "/butler/Buses/can", "/butler/Safety"} <= set(statuses)
    for status in statuses.values():
        assert set(status) == {"level", "name", "message", "hardware_id", "values"}
        pairs = [text for value in status["values"] for text in (value["key"], value["value"])]
        assert all(isinstance(text, str) and text for text in pairs)


def test_a_condition_that_holds_gives_its_part_level_and_words(whole: "Robot") -> None:
    statuses = told(whole)
    bus = statuses["/butler/Buses/servos"]
    assert (bus["level"], bus["message"]) == (DiagnosticLevel.WARN, "A servo bus loses answers.")
    assert {"key": "bus_state", "value": "degraded"} in bus["values"]
    joint = statuses["/butler/Joints/right_elbow"]
    assert (joint["level"], joint["hardware_id"]) == (DiagnosticLevel.ERROR, "butler/right_elbow")
    assert (statuses["/butler/Buses/can"]["level"], statuses["/butler/Safety"]["level"]) == (0, 0)


def test_a_part_whose_process_is_silent_is_stale_and_says_which_topic(whole: "Robot") -> None:
    whole.later(5.0)
    whole.write(process_table=whole.documents["process_table"])
    safety = told(whole)["/butler/Safety"]
    assert safety["level"] == DiagnosticLevel.STALE
    assert safety["message"] == "control_status has been silent for 5.0 s"


def test_what_cannot_be_read_is_a_value_with_its_reason(whole: "Robot") -> None:
    values = told(whole)["/butler/Computer"]["values"]
    assert {"key": "gpu_load_ratio", "value": "missing: missing, because no GPU"} in values
