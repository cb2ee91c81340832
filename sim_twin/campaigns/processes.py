"""Play a campaign's cases in processes of their own, several at a time."""

import multiprocessing
from collections.abc import Callable, Iterable
from typing import TypeVar

from sim_twin.campaigns.orderly_end import end_on_sigterm
from sim_twin.campaigns.report import CaseT, told

T = TypeVar("T")


def played(
    play: Callable[[T], CaseT],
    cases: Iterable[T],
    workers: int,
    tell: Callable[[str], None],
    most_per_process: int,
) -> tuple[CaseT, ...]:
    """Return every case played, in order; after so many a process gives its memory back."""
    with multiprocessing.get_context("spawn").Pool(
        workers, initializer=end_on_sigterm, maxtasksperchild=most_per_process
    ) as pool:
        ended = tuple(told(case, tell) for case in pool.imap(play, cases))
        pool.close()
        pool.join()  # to leave the block would end them as they close their OpenGL
    return ended
