"""One screen shows the robot, in 80 by 24, without colour, and when its processes are silent."""

from io import StringIO
from typing import Any

import pytest
from rich.console import Console

from vla_deploy.cli.observation.top import DOCUMENTS, TopReader, screen


def shown(told: dict[str, Any]) -> list[str]:
    console = Console(file=StringIO(), width=80, height=24, color_system=None)
    with console.capture() as capture:
        console.print(screen(told))
    return capture.get().splitlines()


def row(name: str, **changes: Any) -> dict[str, Any]:
    told = {"name": name, "state": "ready", "restarts": 0, "alarms": [], "reason": ""}
    return {**told, "cpu_ratio": 0.2, "memory_mb": 50.0, **changes}


@pytest.fixture
def told() -> dict[str, Any]:
    names = ("twin", "control", "perception", "speech", "planner", "executor", "recorder")
    rows = [row(name) for name in (*names, "dashboard", "stop_door", "recording")]
    budget = {"process": "perception", "metric": "memory_mb", "measured": 450.0, "limit": 400.0}
    control = {"state": "armed", "estop_latched": False, "cause": "obstacle_slow_zone"}
    why = {"subject": "front", "measured": 0.4, "limit": 0.6, "age_s": 0.05}
    ticks = {"tick": 1000, "late_ticks": 5, "period_s": 0.004}
    buses = {"servos": {"timeouts": 2, "latency": {"p99_s": 0.003}}, "can": {"sent": 5}}
    return {
        "process_table": {
            "robot": "butler",
            "profile": "desktop",
            "twin": True,
            "refusal": "",
            "processes": rows,
        },
        "control_status": {**control, **why, **ticks, "buses": buses},
        "budget": {"rows": [budget], "ladder": {"taken": []}},
        "activity": {"activity": "manipulating", "stopped_by": ""},
        "executor_status": {"skill": "pick_up", "command_id": "cli-1"},
        "planner_status": {"commands": [], "question": None},
        "board": None,
        "twin_status": {"pace": "real", "real_time_factor": 0.6, "held_by": "perception"},
        "battery": {
            "charge_ratio": 0.2,
            "voltage_v": 11.4,
            "current_a": None,
            "is_charging": None,
            "is_estimate": True,
            "low": True,
            "critical": False,
            "missing": {},
        },
        "topics": 12,
        "late_topics": [{"topic": "scan", "age_s": 3.0, "deadline_s": 0.5}],
    }


def test_the_screen_fits_and_says_what_matters_without_colour(told: dict[str, Any]) -> None:
    lines = shown(told)
    assert len(lines) <= 24
    assert max(map(len, lines)) <= 80
    text = "\n".join(lines)
    for words in (
        "safety: armed, obstacle_slow_zone front (0.4, limit 0.6, 0.05 s ago)",
        "twin at 0.6 of real time, held by perception",
        "manipulating: pick_up of cli-1",
        "450!",
        "250 Hz, 5 of 1000 ticks late (0.50 %)",
        "bus servos: answers p99 3.0 ms, timeouts 2",
        "late: scan 3.0 s",
        "battery: 20 % (estimated), 11.4 V, low",
    ):
        assert words in text


def test_a_latched_stop_stands_out_by_its_words(told: dict[str, Any]) -> None:
    told["control_status"] |= {"state": "stopped", "estop_latched": True, "cause": ""}
    assert "safety: stopped, EMERGENCY STOP LATCHED" in shown(told)[1]


def test_silence_is_told(told: dict[str, Any]) -> None:
    lines = shown({**told, **dict.fromkeys(DOCUMENTS)})
    assert lines[0] == "the supervisor is silent"
    assert lines[1] == "safety: control is silent"


def test_late_topics_are_found_in_shared_memory(session: Any, robot: Any, clock: Any) -> None:
    robot.executes(None)
    reader = TopReader(session)
    assert reader.read()["late_topics"] == []
    clock.time_ns += 2_500_000_000
    (late,) = reader.read()["late_topics"]
    assert (late["topic"], late["age_s"]) == ("executor_status", 2.5)
    assert reader.read()["executor_status"]["state"] == "idle"
