"""Find budgets that are exceeded, what is done against it, and a twin that falls behind."""

from collections.abc import Iterator, Mapping
from typing import Final

from drivers.twin_page import TwinPace
from vla_deploy.dashboard.alarms.finding import Finding, Severity
from vla_deploy.dashboard.alarms.told import Document, Told

UNITS: Final[Mapping[str, str]] = {
    "memory_mb": "MB",
    "gpu_memory_mb": "MB",
    "cpu_ratio": "cores",
    "disk_free_mb": "MB",
    "power_w": "W",
    "temperature_c": "°C",
}
_COMPUTER: Final = "computer"
_REAL_TIME: Final = 0.8
_TWIN_RISE_S: Final = 10.0


def exceeded_budgets(told: Told) -> Iterator[Finding]:
    """Find lines that are over, by the judge's own hysteresis, and such as nobody can measure."""
    budget = told.document("budget")
    for row in budget["rows"] if budget is not None else ():
        if row["over"]:
            yield _over(row)
        elif row["state"] == "missing" and row["reason"]:
            yield _missing(row)


def steps_taken(told: Told) -> Iterator[Finding]:
    """Find what the ladder does to the processes meanwhile."""
    budget = told.document("budget")
    for step in budget["ladder"]["taken"] if budget is not None else ():
        action = step["action"].replace("_", " ")
        yield Finding(
            process=step["process"] or _COMPUTER,
            field=f"ladder.{step['action']}",
            text=f"the budgets' ladder has taken the step {action}: {step['why']}",
            severity=Severity.WARNING if step["action"] == "suspend" else Severity.INFO,
            advice="it is undone by itself once there is room again; vla-deploy budget",
            measured=step["ratio"],
            unit="of its rate" if step["ratio"] is not None else "",
            age_s=step["since_s"],
        )


def slow_twin(told: Told) -> Iterator[Finding]:
    """Find a twin that does not keep pace with the wall clock: harmless, where its time waits."""
    status = told.document("twin_status")
    factor = None if status is None else status["real_time_factor"]
    if status is not None and factor is not None and factor < _REAL_TIME:
        waits = status["pace"] != TwinPace.WALL
        yield Finding(
            process="twin",
            field="real_time_factor",
            text=f"the twin is at {factor:.1f} of real time: all takes longer, nothing else changes"
            if waits
            else "the twin falls behind the wall clock: timings mean nothing",
            severity=Severity.INFO if waits else Severity.WARNING,
            advice="give the computer less to do",
            measured=round(factor, 3),
            limit=_REAL_TIME,
            age_s=told.age_s("twin_status"),
            rise_s=_TWIN_RISE_S,
        )


def _over(row: Document) -> Finding:
    whose = row["process"] or _COMPUTER
    than = "less than" if row["at_least"] else "more than"
    return Finding(
        process=whose,
        field=row["metric"],
        text=f"{whose} has {than} its budget of {row['metric']}",
        severity=Severity.WARNING,
        advice="see what it does: vla-deploy budget; vla-deploy logs",
        measured=row["measured"],
        limit=row["limit"],
        unit=UNITS.get(row["metric"], ""),
        rise_s=0.0,
    )


def _missing(row: Document) -> Finding:
    whose = row["process"] or _COMPUTER
    return Finding(
        process=whose,
        field=row["metric"],
        text=f"nobody can measure {row['metric']} of {whose}: {row['reason']}",
        severity=Severity.INFO,
        advice="vla-deploy doctor",
        limit=row["limit"],
        unit=UNITS.get(row["metric"], ""),
    )
