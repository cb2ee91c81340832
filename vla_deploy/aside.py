"""Run work beside a process' steps."""

import os
from collections.abc import Callable
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from typing import Any, Final, TypeVar

T = TypeVar("T")
_NICE: Final = 10


class AtOnce(Executor):
    """Run work at once, on the thread that hands it in: for work of a fraction of a period."""

    def submit(self, fn: Callable[..., T], /, *args: Any, **kwargs: Any) -> "Future[T]":
        """Return a future that is done."""
        future: Future[T] = Future()
        try:
            future.set_result(fn(*args, **kwargs))
        except Exception as error:  # whoever asks the future gets it
            future.set_exception(error)
        return future


def beside(name: str) -> Executor:
    """Return one thread of the same priority as the steps: for work that they wait for."""
    return ThreadPoolExecutor(1, thread_name_prefix=name)


def background() -> Executor:
    """Return one thread that lets the steps of its process go first."""
    return ThreadPoolExecutor(1, thread_name_prefix="prepare", initializer=_give_way)


def _give_way() -> None:
    """Lower this thread alone, below the main thread whose priority it has inherited."""
    os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))
    thread = 0
    inherited = os.getpriority(os.PRIO_PROCESS, thread)
    os.setpriority(os.PRIO_PROCESS, thread, max(_NICE, inherited + 1))
