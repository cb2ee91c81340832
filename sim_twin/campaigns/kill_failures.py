"""Tell what went wrong after a kill, and what of it a computer that stood still may explain."""

from collections.abc import Iterator, Sequence
from typing import Final

from sim_twin.stillness import HELD_UP_S
from vla_deploy.safety.causes import Cause

STOPS_BY_RIGHT: Final = (
    Cause.SERVO_BUS_LOST,
    Cause.CAN_BUS_LOST,
    Cause.SERVO_WATCHDOG_TRIPPED,
    Cause.DRIVE_FAULT,
)
"""What a control stops for whose devices have not answered while the computer stood still."""
_STOPPED: Final = ("protective_stop", "stopping", "stopped", "fault")


class StallFailure(str):
    """Word a failure that a computer that stood still may explain; all others stand."""

    __slots__ = ()


def late(limit_s: float | None, rest_s: float, mover: str) -> Iterator[str]:
    """Return that the robot came to rest too late, if it did."""
    if limit_s is not None and not rest_s <= limit_s:
        yield StallFailure(f"at rest after {rest_s:.2f} s, limit {limit_s:g} s ({mover})")


def late_ready(limit_s: float, ready_s: float) -> Iterator[str]:
    """Return that the processes were ready too late, if they were."""
    if not ready_s <= limit_s:
        yield StallFailure(f"ready after {ready_s:.1f} s, limit {limit_s:g} s")


def wrong_state(state: str, why: str, expected: Sequence[str]) -> str:
    """Return that control is where it must not be; a stop for a lost bus may be by right."""
    words = f"control is {state} ({why}), expected {' or '.join(expected)}"
    lost = any(why.startswith(f"{cause.value}:") for cause in STOPS_BY_RIGHT)
    by_right = "armed" in expected and state in _STOPPED and lost
    return StallFailure(words) if by_right else words


def is_void(failures: Sequence[str], held_up_s: float) -> bool:
    """Tell whether a try says nothing: the computer stood still, and that explains all of it."""
    explained = all(isinstance(failure, StallFailure) for failure in failures)
    return bool(failures) and held_up_s >= HELD_UP_S and explained
