"""Say to which part of the robot each metric belongs: the hierarchy of the diagnostics."""

from typing import Final

from vla_deploy.telemetry.metrics import Metric

SUBJECTS: Final = {"process": "Processes", "bus": "Buses", "joint": "Joints", "topic": "Topics"}
"""Labels whose values are parts of their own, and what they lie under."""

_TABLE: Final[tuple[tuple[tuple[str, ...], str], ...]] = (
    (("vla_safety_", "vla_estop_"), "Safety"),
    (("vla_control_",), "Control"),
    (("vla_base_",), "Base"),
    (("vla_planner_", "vla_executor_", "vla_commands_"), "Planning"),
    (("vla_speech_",), "Hearing"),
    (("vla_perception_",), "Seeing"),
    (("vla_place_",), "Place"),
    (("vla_flight_recorder_",), "Flight recorder"),
    (("vla_twin_",), "Twin"),
    (("vla_budget_", "vla_ladder_", "vla_memory_peak"), "Budgets"),
    (("vla_dashboard_", "vla_metrics_", "vla_build_", "vla_robot_"), "Dashboard"),
)


def part_of(metric: Metric, labels: dict[str, str]) -> str:
    """Return the part of the robot that a value is about, with slashes between its levels."""
    for label, group in SUBJECTS.items():
        if label in labels:
            return f"{group}/{labels[label]}"
    return group_of(metric)


def group_of(metric: Metric) -> str:
    """Return the upper level of a metric's parts."""
    subject = next((SUBJECTS[label] for label in metric.labels if label in SUBJECTS), None)
    if subject is not None:
        return subject
    return next(
        (group for prefixes, group in _TABLE if metric.name.startswith(prefixes)), "Computer"
    )
