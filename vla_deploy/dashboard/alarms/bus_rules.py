"""Find buses that are not open, and devices whose answers go missing."""

from collections.abc import Iterator, Sequence
from typing import Final

from vla_deploy.dashboard.alarms.finding import Finding, Severity
from vla_deploy.dashboard.alarms.told import Document, Told

_CABLE: Final = "check cable, termination and the device's power"
_SHOWN: Final = 4
_SERVOS: Final = {
    "lost": ("has lost", Severity.ERROR),
    "degraded": ("gets too few answers of", Severity.WARNING),
}
_NODES: Final = {
    "lost_nodes": ("has lost nodes", Severity.ERROR),
    "degraded_nodes": ("has nodes that answer badly", Severity.WARNING),
    "bus_degraded": ("carries damaged frames", Severity.WARNING),
}
"""Counters of a CAN bus that are zero while all is well."""


def troubled_buses(told: Told) -> Iterator[Finding]:
    """Find what each bus counts against itself.

    With the emergency stop latched nothing is told: a button may cut the power of the devices.
    """
    status = told.document("control_status")
    if status is None or status["estop_latched"]:
        return
    for name, counters in status["buses"].items():
        if not counters:
            text = f"bus {name} is not open"
            yield _found(name, text, Severity.ERROR, told)
            continue
        yield from _budget(name, counters.get("budget", {}), told)
        yield from _nodes(name, counters, told)


def _budget(name: str, budget: Document, told: Told) -> Iterator[Finding]:
    if budget.get("bus") == "lost":
        text = f"bus {name} is lost: too many answers missing or damaged"
        yield _found(name, text, Severity.ERROR, told)
    elif budget.get("bus") == "degraded":
        text = f"bus {name} is degraded: answers go missing"
        yield _found(name, text, Severity.WARNING, told)
    for standing, (words, severity) in _SERVOS.items():
        joints = budget.get(standing, ())
        if joints:
            text = f"bus {name} {words}: {_listed(joints)}"
            yield _found(f"{name}.{standing}", text, severity, told, count=len(joints))


def _nodes(name: str, counters: Document, told: Told) -> Iterator[Finding]:
    for counter, (words, severity) in _NODES.items():
        count = int(counters.get(counter, 0))
        if count:
            yield _found(f"{name}.{counter}", f"bus {name} {words}", severity, told, count=count)


def _found(
    field: str, text: str, severity: Severity, told: Told, count: int | None = None
) -> Finding:
    return Finding(
        process="control",
        field=f"buses.{field}",
        text=text,
        severity=severity,
        advice=_CABLE,
        measured=None if count is None else float(count),
        limit=None if count is None else 0.0,
        age_s=told.age_s("control_status"),
    )


def _listed(names: Sequence[str]) -> str:
    more = len(names) - _SHOWN
    return ", ".join(names[:_SHOWN]) + (f" and {more} more" if more > 0 else "")
