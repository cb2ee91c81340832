"""Provide a robot whose processes report what the metrics read."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from drivers.clock import NS_PER_S
from drivers.latency import LatencyHistogram
from drivers.servo.counters import BusCounters
from platforms.probes import Reading
from vla_deploy.control.reporting.tick_periods import TickPeriods
from vla_deploy.ipc import SharedSpace
from vla_deploy.supervisor.budgets.documents import board
from vla_deploy.telemetry.metrics import READ_TOPICS, Readings, TopicSampler, TopicSnapshot, read

JOINTS = ("left_elbow", "right_elbow")
OWN = {"version": "1.2.3", "look_s": 0.002, "left_out": 0, "clients": 3}


def control_status() -> dict[str, Any]:
    latency, periods = LatencyHistogram(), TickPeriods()
    for latency_ns in (900_000, 1_100_000, 3_000_000):
        latency.record(latency_ns)
    for ratio in (1.0, 1.0, 1.3):
        periods.count(ratio)
    return {
        "state": "armed",
        "estop_latched": False,
        "cause": "obstacle_slow_zone",
        "reaction": "base_slow",
        "age_s": 0.02,
        "speed_ratio": 0.4,
        "tick": 1000,
        "late_ticks": 1,
        "period_s": 0.0041,
        "nominal_period_s": 0.004,
        "period_ratio": periods.document(),
        "buses": {
            "servos": {
                **BusCounters(cycles=1000, timeouts=2).as_dict(),
                "latency": latency.as_dict(),
                "budget": {"bus": "degraded", "degraded": ["left_elbow"], "lost": []},
            },
            "can": {"sent": 7, "received": 9, "error_frames": 4, "degraded_nodes": 0},
        },
        "joints": {"temperature_c": [31.0, None], "voltage_v": [12.1, 12.0]},
        "active_motions": [5],
    }


def process_row(name: str, **changes: Any) -> dict[str, Any]:
    told = {"name": name, "state": "ready", "restarts": 0, "alarms": [], "reason": "", "pid": 7}
    usage = {"memory_mb": 50.0, "rss_mb": 70.0, "cpu_s": 3.5, "cpu_ratio": 0.2}
    return {**told, **usage, **changes}


def budget_row(metric: str, measured: float | None, limit: float, **more: Any) -> dict[str, Any]:
    row = {"process": None, "metric": metric, "measured": measured, "limit": limit, "over": False}
    return {**row, "at_least": metric == "disk_free_mb", "state": "kept", "reason": "", **more}


DOCUMENTS: dict[str, dict[str, Any]] = {
    "control_status": control_status(),
    "process_table": {
        "robot": "butler",
        "profile": "desktop",
        "twin": True,
        "refusal": "",
        "processes": [process_row("control"), process_row("planner", restarts=2, alarms=["old"])],
        "supervisor": {"memory_mb": 30.0, "rss_mb": 40.0, "cpu_s": 1.0},
        "peak_memory_mb": 400.0,
    },
    "budget": {
        "rows": [
            budget_row("cpu_ratio", 0.2, 0.8, process="control"),
            budget_row("memory_mb", 500.0, 400.0, process="perception", over=True),
            budget_row("temperature_c", None, 85.0),
            budget_row("disk_free_mb", 1000.0, 500.0),
        ],
        "ladder": {"step": 1, "counts": {"taken": 3, "undone": 2}},
        "stop": False,
    },
    "resource_directives": {"rate_ratio": {"perception": 0.5}},
    "board": board(
        [
            *(
                Reading(name=name, value=value, unit="")
                for name, value in {
                    "cpu_ratio": 0.3,
                    "cpu_frequency_hz": 1.5e9,
                    "memory_total_bytes": 8e9,
                    "memory_available_bytes": 5e9,
                    "swap_used_bytes": 0.0,
                    "power_w": 9.5,
                    "gpu_memory_used_bytes": 1e9,
                    "gpu_frequency_hz": 9e8,
                    "fan_rpm": 2000.0,
                    "emc_load_ratio": 0.2,
                    "fan_drive_ratio": 0.4,
                    "power_mode_id": 2.0,
                    "temperature_c": 61.5,
                    "disk_free_bytes": 6e9,
                    "disk_free_ratio": 0.4,
                    "power_w.VDD_IN": 9.5,
                    "temperature_c.cpu-thermal": 61.5,
                    "throttle_count.oc1": 1.0,
                    "psi_cpu_ratio": 0.05,
                }.items()
            ),
            Reading(name="gpu_load_ratio", value=None, unit="", reason="missing, because no GPU"),
        ]
    ),
    "planner_status": {
        "heard": 4,
        "planned": 3,
        "refused": 1,
        "asked": 0,
        "failed": 0,
        "by_rung": {"rules": {"planned": 3, "declined": 1}},
        "commands": ["cli-1"],
        "away": {"cloud": "no key"},
    },
    "executor_status": {"state": "executing"},
    "speech_status": {
        "state": "listening",
        "heard": {
            "accepted": 3,
            "rejected": 1,
            "stop": 0,
            "end_to_text_p50_s": 0.6,
            "end_to_text_p95_s": 0.9,
        },
    },
    "scene": {
        "objects": [{}, {}],
        "sight": {
            "mode": "network",
            "model": {"runs": 40, "failures": 0, "busy_s": 0.4, "p50_s": 0.01, "p95_s": 0.02},
        },
        "image": {"faults": ["dark"], "refused": 2},
        "away": {},
    },
    "recorder_status": {"writing": False, "held_bytes": 1000},
    "twin_status": {"real_time_factor": 0.99},
    "battery": {
        "charge_ratio": 0.63,
        "voltage_v": 25.9,
        "current_a": -2.1,
        "is_charging": False,
        "low": False,
        "critical": False,
        "missing": {},
    },
}


class Robot:
    """Write documents and packed cells, and read the metrics."""

    documents = DOCUMENTS

    def __init__(self, folder: Path, clock: Any) -> None:
        self.clock = clock
        self.space = SharedSpace(folder / "ipc", self.clock)
        self.sampler = TopicSampler(self.space, self.clock, READ_TOPICS, lambda _: JOINTS)
        self._writers = {name: self.space.cell_writer(name) for name in READ_TOPICS}

    def write(self, **documents: dict[str, Any]) -> None:
        for name, document in documents.items():
            self._writers[name].put_document(document)

    def write_all(self) -> None:
        self.write(**DOCUMENTS)
        zeros = dict.fromkeys(("position", "velocity", "setpoint", "age_s"), ())
        self._writers["joint_state"].put(
            **zeros, joint_count=2, effort_ratio=(0.1, -0.2), error=(0, 4), torque_enabled=(1, 1)
        )
        base = dict.fromkeys(("x_m", "y_m", "yaw_rad", "w_rad_s"), 0.0)
        self._writers["base_state"].put(**base, v_m_s=0.25, enabled=1)
        place = {"x_m": 0.0, "y_m": 0.0, "yaw_rad": 0.0, "covariance": np.zeros(9)}
        self._writers["pose"].put(**place, match_ratio=0.9, state=1, doubt=0)

    def later(self, seconds: float) -> None:
        self.clock.time_ns += round(seconds * NS_PER_S)

    def look(self) -> TopicSnapshot:
        return self.sampler.snapshot(OWN)

    def read(self) -> Readings:
        return read(self.look())


@pytest.fixture
def robot(tmp_path: Path, clock: Any) -> Iterator[Robot]:
    robot = Robot(tmp_path, clock)
    yield robot
    robot.space.close()


@pytest.fixture
def whole(robot: Robot) -> Robot:
    """Return a robot whose processes have all written twice within a second."""
    robot.write_all()
    robot.look()
    robot.later(1.0)
    robot.write_all()
    return robot
