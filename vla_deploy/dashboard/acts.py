"""Know by what control shows that an operator's act was carried out."""

import asyncio
from collections.abc import Callable, Mapping
from typing import Any, Final

from drivers.clock import NS_PER_S
from vla_deploy.dashboard.link import RobotLink

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


async def carried_out(link: RobotLink, act: str, within_s: float) -> tuple[bool, Status | None]:
    """Wait until control shows an act, or the time is over; return its last status, too."""
    end_ns = link.clock.now_ns() + round(within_s * NS_PER_S)
    while True:
        status = link.document("control_status", age_limit_s=1.0)
        if status is not None and REACHED[act](status):
            return True, status
        if link.clock.now_ns() >= end_ns:
            return False, status
        await asyncio.sleep(0.02)
