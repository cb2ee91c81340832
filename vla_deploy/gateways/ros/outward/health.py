"""Judge the robot's parts from what its processes tell, for people who look at diagnostics."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from enum import IntEnum
from typing import Any, Final

Json = dict[str, Any]
Documents = Mapping[str, Json | None]
"""By the name of the topic; None where nobody has told anything lately."""

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
"""Which topics are asked for, and how old in s what they tell may be."""


class HealthLevel(IntEnum):
    """Name how well a part does, in the numbers of diagnostic_msgs/DiagnosticStatus."""

    OK = 0
    WARN = 1
    ERROR = 2
    STALE = 3


@dataclass(frozen=True, slots=True, kw_only=True)
class PartHealth:
    """Describe how one part does; `values` are shown beside it."""

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
    return [health for judge in _JUDGES for health in judge(documents)]


def _processes(documents: Documents) -> Iterator[PartHealth]:
    table = documents["process_table"]
    if table is None:
        yield _silent("supervisor")
        return
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


def _control(documents: Documents) -> Iterator[PartHealth]:
    status = documents["control_status"]
    if status is None:
        yield _silent("control")
        return
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


def _buses(documents: Documents) -> Iterator[PartHealth]:
    status = documents["control_status"]
    for name, told in ({} if status is None else status.get("buses", {})).items():
        budget = told.get("budget", {})
        level = _BUS.get(budget.get("bus", "ok"), HealthLevel.WARN)
        words = [f"{key}: {', '.join(map(str, budget[key]))}" for key in _UNWELL if budget.get(key)]
        words += [str(one) for one in told.get("faults", ())]
        words += [f"{told[key]} {key}" for key in _UNWELL_NODES if told.get(key)]
        if words:
            level = max(level, HealthLevel.WARN)
        if budget.get("lost") or told.get("lost_nodes"):
            level = HealthLevel.ERROR
        yield PartHealth(
            name=f"bus {name}",
            level=level,
            message="; ".join(words) or "ok",
            values={key: told[key] for key in _BUS_COUNTS if key in told},
        )


_UNWELL: Final = ("degraded", "lost")
_UNWELL_NODES: Final = ("degraded_nodes", "lost_nodes", "bus_degraded")


def _budgets(documents: Documents) -> Iterator[PartHealth]:
    budget, stop = documents["budget"], documents["budget_stop"] or {}
    if budget is None:
        yield _silent("budgets")
        return
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


def _eyes(documents: Documents) -> Iterator[PartHealth]:
    scene = documents["scene"]
    if scene is None:
        yield _silent("perception")
        return
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


def _planner(documents: Documents) -> Iterator[PartHealth]:
    planner, executor = documents["planner_status"], documents["executor_status"]
    if planner is None:
        yield _silent("planner")
    else:
        away = planner.get("away") or {}
        yield PartHealth(
            name="planner",
            level=HealthLevel.WARN if away else HealthLevel.OK,
            message="; ".join(f"{rung}: {why}" for rung, why in away.items()) or "ok",
            values={key: planner.get(key) for key in ("heard", "planned", "refused", "failed")},
        )
    if executor is None:
        yield _silent("executor")
    else:
        recovering = executor["state"] == "recovering"
        yield PartHealth(
            name="executor",
            level=HealthLevel.WARN if recovering else HealthLevel.OK,
            message=str(executor["state"]),
            values={key: executor.get(key) for key in ("command_id", "action_id", "skill")},
        )


def _speech(documents: Documents) -> Iterator[PartHealth]:
    speech = documents["speech_status"]
    if speech is None:
        yield PartHealth(name="speech", level=HealthLevel.STALE, message="no speech process runs")
        return
    voice = speech.get("voice") or {}
    words = [speech["state"], *filter(None, (speech.get("why"), voice.get("why")))]
    deaf = speech["state"] == "deaf" or voice.get("state") != "ready"
    yield PartHealth(
        name="speech",
        level=HealthLevel.WARN if deaf else HealthLevel.OK,
        message="; ".join(words),
        values={"voice": voice.get("state"), "speaking": speech.get("speaking")},
    )


def _silent(name: str) -> PartHealth:
    return PartHealth(name=name, level=HealthLevel.STALE, message="it is silent")


_JUDGES: Final[tuple[Callable[[Documents], Iterator[PartHealth]], ...]] = (
    *(_processes, _control, _buses, _budgets, _eyes, _planner, _speech),
)
