"""Every metric is read from what the processes tell, or missing with the reason."""

from typing import TYPE_CHECKING

import pytest

from vla_deploy.telemetry.metrics import MAX_SERIES, METRICS, MissingReason, Readings

if TYPE_CHECKING:
    from conftest import Robot


def value(readings: Readings, name: str, *labels: str) -> object:
    return next(point.value for point in readings.points[name] if point.labels == labels)


def why(readings: Readings, name: str) -> tuple[MissingReason, str]:
    return next((one.why, one.text) for one in readings.missing if one.metric == name)


def test_every_metric_is_read_but_what_the_computer_cannot_tell(whole: "Robot") -> None:
    readings = whole.read()
    assert {one.metric for one in readings.missing} == {"vla_gpu_load_ratio"}
    assert set(readings.points) == {metric.name for metric in METRICS} - {"vla_gpu_load_ratio"}


def test_nothing_is_read_as_zero_before_anybody_has_told(robot: "Robot") -> None:
    readings = robot.read()
    told_by_itself = {"vla_build_info", "vla_metrics_look_seconds", "vla_metrics_left_out"}
    assert set(readings.points) == told_by_itself | {"vla_dashboard_clients"}
    assert why(readings, "vla_control_ticks_total") == (
        MissingReason.SILENT,
        "nobody has written control_status yet",
    )


def test_values_come_in_base_units(whole: "Robot") -> None:
    readings = whole.read()
    assert value(readings, "vla_process_memory_bytes", "control") == 50e6
    assert value(readings, "vla_process_memory_bytes", "supervisor") == 30e6
    assert value(readings, "vla_process_memory_limit_bytes", "perception") == 400e6
    assert value(readings, "vla_power_rail_watts", "VDD_IN") == 9.5
    assert value(readings, "vla_joint_hardware_error", "right_elbow") == 1.0
    assert value(readings, "vla_robot_info", "butler", "desktop", "true") == 1.0


def test_a_state_is_one_and_the_others_are_zero(whole: "Robot") -> None:
    points = whole.read().points["vla_bus_state"]
    assert {point.labels: point.value for point in points} == {
        ("servos", "ok"): 0.0,
        ("servos", "degraded"): 1.0,
        ("servos", "lost"): 0.0,
    }


def test_a_process_that_falls_silent_takes_its_metrics_with_it(whole: "Robot") -> None:
    whole.later(3.5)
    whole.write(process_table=whole.documents["process_table"])
    readings = whole.read()
    assert why(readings, "vla_control_state") == (
        MissingReason.SILENT,
        "control_status has been silent for 3.5 s",
    )
    assert value(readings, "vla_process_restarts_total", "planner") == 2.0


def test_what_the_computer_cannot_tell_is_missing_with_its_own_words(whole: "Robot") -> None:
    assert why(whole.read(), "vla_gpu_load_ratio") == (
        MissingReason.UNREADABLE,
        "missing, because no GPU",
    )


def test_what_is_null_in_a_document_is_left_out_alone(whole: "Robot") -> None:
    readings = whole.read()
    labels = [point.labels for point in readings.points["vla_joint_temperature_celsius"]]
    assert labels == [("left_elbow",)]
    budgets = {point.labels: point.value for point in readings.points["vla_budget_used_ratio"]}
    assert budgets == {
        ("control", "cpu_ratio"): pytest.approx(0.25),
        ("perception", "memory_mb"): pytest.approx(1.25),
        ("total", "disk_free_mb"): pytest.approx(0.5),
    }


def test_a_metric_with_too_many_series_loses_the_last_and_that_is_counted(whole: "Robot") -> None:
    table = whole.documents["process_table"]
    (row, *_) = table["processes"]
    rows = [row | {"name": f"p{number}" + "x" * 100} for number in range(MAX_SERIES + 5)]
    whole.write(process_table=table | {"processes": rows})
    readings = whole.read()
    points = readings.points["vla_process_memory_bytes"]
    assert len(points) == MAX_SERIES
    assert readings.left_out > 5
    assert max(len(point.labels[0]) for point in points) == 64


def test_the_rate_of_a_topic_is_what_was_put_within_the_window(robot: "Robot") -> None:
    robot.look()
    for _ in range(20):
        robot.write(twin_status=robot.documents["twin_status"])
        robot.later(0.5)
        robot.look()
    readings = robot.read()
    assert value(readings, "vla_topic_messages_total", "twin_status") == 20.0
    assert value(readings, "vla_topic_rate_hertz", "twin_status") == pytest.approx(2.0, abs=0.3)
    assert value(readings, "vla_topic_age_seconds", "twin_status") == pytest.approx(0.5)
