"""Put control's state into the words and numbers of `control_status`."""

import math
from collections.abc import Mapping
from typing import Any, Protocol

import numpy as np

from drivers.servo.state import BusState
from vla_deploy.control.motion.axes import Floats
from vla_deploy.ipc.payloads.motion import JointReadings, VerdictFields
from vla_deploy.safety import Cause, Verdict

_LONGEST_DETAIL = 1500


class Bus(Protocol):
    """Be a bus that counts what it carries."""

    name: str

    @property
    def counters(self) -> Mapping[str, Any] | None:
        """Return what it has counted; empty while it is not open, None where there is none."""
        ...


def verdict_document(verdict: Verdict) -> VerdictFields:
    """Return who stops or slows the robot and by which numbers; null where none applies."""
    return {
        "cause": "" if verdict.cause is Cause.NONE else verdict.cause.value,
        "reaction": verdict.reaction.name.lower(),
        "subject": verdict.subject,
        "measured": _number(verdict.measured),
        "limit": _number(verdict.limit),
        "age_s": _number(verdict.age_s),
        "speed_ratio": verdict.speed_ratio,
        "blocked": sorted(verdict.blocked),
    }


def detail(*parts: str) -> str:
    """Return what there is to say, bounded."""
    return "; ".join(part for part in parts if part)[:_LONGEST_DETAIL]


def bus_document(*buses: Bus) -> dict[str, Mapping[str, Any]]:
    """Return each bus' counters by its name."""
    told = ((bus.name, bus.counters) for bus in buses)
    return {name: counters for name, counters in told if counters is not None}


def joint_document(state: BusState) -> JointReadings:
    """Return what servos tell slowly, in joint order; null where it was not read yet."""
    return {
        "temperature_c": _tenths(state.temperature_c),
        "voltage_v": _tenths(state.voltage_v),
    }


def _tenths(values: Floats) -> list[float | None]:
    rounded: list[float | None] = np.round(values, 1).tolist()
    if np.isfinite(values).all():
        return rounded
    return [value if value is not None and math.isfinite(value) else None for value in rounded]


def _number(value: float) -> float | None:
    return round(value, 6) if math.isfinite(value) else None
