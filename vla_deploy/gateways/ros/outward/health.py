"""Judge the robot's parts from what its processes publish, for people who look at diagnostics."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from enum import IntEnum
from typing import Any, Final

Json = dict[str, Any]
Documents = Mapping[str, Json | None]
"""By the name of the topic; None where nobody has published lately."""

TOPICS: Final[Mapping[str, float]] = {
    "process_table": 3.0,
    "control_status": 1.0,
    "scene": 3.0,
    "planner_status": 3.0,
    "executor_status": 2.0,
    "speech_status": 3.0,
    "budget": 3.0,
    "budget_stop": 3.0,
    "board": 3.0,
}
"""Which topics are read, and how old in s they may be."""


class HealthLevel(IntEnum):
    """Name how well a part does, in the numbers of diagnostic_msgs/DiagnosticStatus."""

    OK = 0
    WARN = 1
    ERROR = 2
    STALE = 3


@dataclass(frozen=True, slots=True, kw_only=True)
class PartHealth:
    """Describe how one part does; `values` are shown with it."""

    name: str
    level: HealthLevel
    message: str
    values: Mapping[str, Any] = field(default_factory=dict)


_CONTROL: Final[Mapping[str, HealthLevel]] = {
    "armed": HealthLevel.OK,
    "disarmed": HealthLevel.OK,
    "protective_stop": HealthLevel.WARN,
    "stopping": HealthLevel.WARN,
    "stopped": HealthLevel.WARN,
    "fault": HealthLevel.ERROR,
}
_PROCESS: Final[Mapping[str, HealthLevel]] = {
    "ready": HealthLevel.OK,
    "off": HealthLevel.OK,
    "given up": HealthLevel.ERROR,
}
_BUS: Final[Mapping[str, HealthLevel]] = {
    "ok": HealthLevel.OK,
    "degraded": HealthLevel.WARN,
    "lost": HealthLevel.ERROR,
}
_BUS_COUNTS: Final = (
    *("cycles", "partial_cycles", "timeouts", "crc_errors", "retries", "link_lost"),
    *("sent", "received", "dropped", "malformed", "error_frames", "degraded_nodes", "lost_nodes"),
)


def health_of(documents: Documents) -> list[PartHealth]:
    """Return how every part does: processes, control, buses, budgets, eyes, planner, speech."""
    found: list[PartHealth] = []
    for topic, part, judge in _JUDGES:
        document = documents[topic]
        if document is not None:
            found += judge(document, documents)
        elif part:
            silent = _SILENT.get(part, "it is silent")
            found.append(PartHealth(name=part, level=HealthLevel.STALE, message=silent))
    return found


def _processes(table: Json, documents: Documents) -> Iterator[PartHealth]:
    for row in table["processes"]:
        level = _PROCESS.get(row["state"], HealthLevel.WARN)
        alarms = list(row.get("alarms", ()))
        if level is HealthLevel.OK and alarms:
            level = HealthLevel.WARN
        keys = ("pid", "restarts", "exit_code", "memory_mb", "cpu_ratio")
        yield PartHealth(
            name=f"process {row['name']}",
            level=level,
            message="; ".join((row["state"], *filter(None, (row.get("reason"), *alarms)))),
            values={key: row.get(key) for key in keys},
        )


def _control(status: Json, documents: Documents) -> Iterator[PartHealth]:
    latched = bool(status["estop_latched"])
    level = HealthLevel.ERROR if latched else _CONTROL.get(status["state"], HealthLevel.WARN)
    if status.get("cause"):
        level = max(level, HealthLevel.WARN)
    words = [status["state"], status.get("cause"), status.get("detail")]
    yield PartHealth(
        name="control",
        level=level,
        message=": ".join(filter(None, words)),
        values={
            "estop_latched": latched,
            "speed_ratio": status.get("speed_ratio"),
            "late_ticks": status.get("late_ticks"),
            "period_s": status.get("period_s"),
            "hottest_joint_c": _most(status, "temperature_c", max),
            "lowest_joint_v": _most(status, "voltage_v", min),
        },
    )


def _most(status: Json, name: str, of: Callable[[list[float]], float]) -> float | None:
    values = [one for one in status.get("joints", {}).get(name, ()) if one is not None]
    return of(values) if values else None


def _buses(status: Json, documents: Documents) -> Iterator[PartHealth]:
    for name, bus in status.get("buses", {}).items():
        budget = bus.get("budget", {})
        level = _BUS.get(budget.get("bus", "ok"), HealthLevel.WARN)
        words = [f"{key}: {', '.join(map(str, budget[key]))}" for key in _UNWELL if budget.get(key)]
        words += [str(one) for one in bus.get("faults", ())]
        words += [f"{bus[key]} {key}" for key in _UNWELL_NODES if bus.get(key)]
        if words:
            level = max(level, HealthLevel.WARN)
        if budget.get("lost") or bus.get("lost_nodes"):
            level = HealthLevel.ERROR
        yield PartHealth(
            name=f"bus {name}",
            level=level,
            message="; ".join(words) or "ok",
            values={key: bus[key] for key in _BUS_COUNTS if key in bus},
        )


_UNWELL: Final = ("degraded", "lost")
_UNWELL_NODES: Final = ("degraded_nodes", "lost_nodes", "bus_degraded")


def _budgets(budget: Json, documents: Documents) -> Iterator[PartHealth]:
    stop = documents["budget_stop"] or {}
    over = [row for row in budget["rows"] if row.get("over")]
    taken = budget.get("ladder", {}).get("taken", ())
    level = HealthLevel.WARN if over or taken else HealthLevel.OK
    words = [f"{row['process'] or 'in total'} {row['metric']} {row['measured']}" for row in over]
    words += [f"{one['action']} {one['process'] or ''}".strip() for one in taken]
    if stop.get("stop"):
        level, words = HealthLevel.ERROR, [str(stop.get("reason")), *words]
    readings = (documents["board"] or {}).get("readings", {})
    shown = ("cpu_ratio", "memory_available_bytes", "gpu_load_ratio", "temperature_c", "power_w")
    yield PartHealth(
        name="budgets",
        level=level,
        message="; ".join(words) or "ok",
        values={key: readings[key] for key in shown if key in readings},
    )


def _eyes(scene: Json, documents: Documents) -> Iterator[PartHealth]:
    away, image, sight = (scene.get(key) or {} for key in ("away", "image", "sight"))
    words = [f"{sensor}: {why}" for sensor, why in away.items()]
    level = HealthLevel.ERROR if words else HealthLevel.OK
    if image.get("use", "all") != "all":
        words.append(f"image used for {image['use']}: {', '.join(image.get('faults', ()))}")
    if sight.get("why"):
        words.append(f"sight by {sight.get('mode')}: {sight['why']}")
    if words:
        level = max(level, HealthLevel.WARN)
    lost = "robot" in scene and scene["robot"] is None
    if lost:
        level, words = HealthLevel.ERROR, ["the place on the map is lost", *words]
    yield PartHealth(
        name="perception",
        level=level,
        message="; ".join(words) or "ok",
        values={"objects": len(scene["objects"]), "sight": sight.get("mode")},
    )


def _planner(planner: Json, documents: Documents) -> Iterator[PartHealth]:
    away = planner.get("away") or {}
    yield PartHealth(
        name="planner",
        level=HealthLevel.WARN if away else HealthLevel.OK,
        message="; ".join(f"{rung}: {why}" for rung, why in away.items()) or "ok",
        values={key: planner.get(key) for key in ("heard", "planned", "refused", "failed")},
    )


def _executor(executor: Json, documents: Documents) -> Iterator[PartHealth]:
    recovering = executor["state"] == "recovering"
    yield PartHealth(
        name="executor",
        level=HealthLevel.WARN if recovering else HealthLevel.OK,
        message=str(executor["state"]),
        values={key: executor.get(key) for key in ("command_id", "action_id", "skill")},
    )


def _speech(speech: Json, documents: Documents) -> Iterator[PartHealth]:
    voice = speech.get("voice") or {}
    words = [speech["state"], *filter(None, (speech.get("why"), voice.get("why")))]
    deaf = speech["state"] == "deaf" or voice.get("state") != "ready"
    yield PartHealth(
        name="speech",
        level=HealthLevel.WARN if deaf else HealthLevel.OK,
        message="; ".join(words),
        values={"voice": voice.get("state"), "speaking": speech.get("speaking")},
    )


_JUDGES: Final[tuple[tuple[str, str, Callable[[Json, Documents], Iterator[PartHealth]]], ...]] = (
    ("process_table", "supervisor", _processes),
    ("control_status", "control", _control),
    ("control_status", "", _buses),
    ("budget", "budgets", _budgets),
    ("scene", "perception", _eyes),
    ("planner_status", "planner", _planner),
    ("executor_status", "executor", _executor),
    ("speech_status", "speech", _speech),
)
"""By topic: what is stale where nobody publishes it, and who judges what is published."""
_SILENT: Final = {"speech": "no speech process runs"}
