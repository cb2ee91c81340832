"""Word what went wrong after a kill."""

from collections.abc import Iterator, Sequence


def late(limit_s: float | None, rest_s: float, mover: str) -> Iterator[str]:
    """Return that the robot came to rest too late, if it did."""
    if limit_s is not None and not rest_s <= limit_s:
        yield f"at rest after {rest_s:.2f} s, limit {limit_s:g} s ({mover})"


def late_ready(limit_s: float, ready_s: float) -> Iterator[str]:
    """Return that the processes were ready too late, if they were."""
    if not ready_s <= limit_s:
        yield f"ready after {ready_s:.1f} s, limit {limit_s:g} s"


def wrong_state(state: str, why: str, expected: Sequence[str]) -> str:
    """Return that control is where it must not be."""
    return f"control is {state} ({why}), expected {' or '.join(expected)}"
