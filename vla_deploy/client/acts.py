"""Know by what control shows that an operator's act was carried out."""

from collections.abc import Callable, Mapping
from typing import Any, Final

Status = Mapping[str, Any]

REACHED: Final[Mapping[str, Callable[[Status], bool]]] = {
    "estop": lambda status: bool(status["estop_latched"]),
    "reset": lambda status: (
        status["state"] in ("disarmed", "armed", "protective_stop") and not status["estop_latched"]
    ),
    "arm": lambda status: status["state"] == "armed",
    "disarm": lambda status: status["state"] == "disarmed",
}


def why_not(status: Status | None) -> str:
    """Return in words how control stands in the way of an act."""
    if status is None:
        return "control does not answer"
    why = status["detail"] or status["cause"] or "no reason given"
    return f"control is still {status['state']}: {why}"
