"""Run work in steps that never wait, so that a control loop goes on between them."""

from collections.abc import Callable, Iterator, Sequence
from typing import Final

from drivers.clock import Clock

POLL_NS: Final = 500_000
FRAMES_BEFORE_YIELD: Final = 4
_ENDED: Final = object()


def wait_for(steps: Iterator[None], clock: Clock) -> None:
    """Run steps to their end, waiting a little between them."""
    for _ in steps:
        clock.sleep_until(clock.now_ns() + POLL_NS)


def side_by_side(runs: Sequence[Iterator[None]]) -> Iterator[None]:
    """Step several runs in turn until all have ended."""
    going = list(runs)
    while going:
        going = [run for run in going if next(run, _ENDED) is not _ENDED]
        if going:
            yield


def until(done: Callable[[], bool], clock: Clock, timeout_ns: int) -> Iterator[None]:
    """Yield until `done()` or the time is up; the caller judges which."""
    deadline_ns = clock.now_ns() + timeout_ns
    while not done() and clock.now_ns() <= deadline_ns:
        yield


def listening(steps: Iterator[None], take_frames: Callable[[], bool]) -> Iterator[None]:
    """Hand steps what has arrived between any two of them; yield where nothing has.

    It yields now and then anyway, so that a chattering bus does not hold the caller up.
    """
    in_a_row = 0
    for _ in steps:
        in_a_row += 1
        if not take_frames() or in_a_row >= FRAMES_BEFORE_YIELD:
            in_a_row = 0
            yield
            take_frames()
