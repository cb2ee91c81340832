"""Run work beside a process' steps."""

import itertools
import os
import threading
from collections.abc import Callable
from concurrent.futures import CancelledError, Executor, Future, ThreadPoolExecutor
from typing import Any, Final, TypeVar

from drivers.clock import NS_PER_S, Clock
from drivers.twin_clock import TimeLine, TwinClock
from drivers.twin_page import Op, TimeRole

T = TypeVar("T")
_NICE: Final = 10
_BACKGROUND_S: Final = 0.5


class InlineExecutor(Executor):
    """Run work at once, on the thread that hands it in: for work of a fraction of a period."""

    def submit(self, fn: Callable[..., T], /, *args: Any, **kwargs: Any) -> "Future[T]":
        """Return a future that is done."""
        future: Future[T] = Future()
        try:
            future.set_result(fn(*args, **kwargs))
        except Exception as error:  # whoever asks the future gets it
            future.set_exception(error)
        return future


class TwinWorker(Executor):
    """Run work in a thread that takes part in the twin's time.

    A piece of work takes `computing_s` of simulated time from when it is handed in, or from when
    the one before it is done: its future is done then and not before, and time does not pass that
    moment until it really is.
    """

    def __init__(
        self, name: str, clock: TwinClock, computing_s: float, inner: ThreadPoolExecutor
    ) -> None:
        self._clock = clock
        self._computing_ns = round(computing_s * NS_PER_S)
        self._inner = inner
        self._role = TimeRole(name=name, order=50)
        self._lock = threading.Lock()
        self._line: TimeLine | None = None
        self._free_ns = 0
        self._numbers = itertools.count()
        self._due_ns: dict[int, int] = {}

    def submit(self, fn: Callable[..., T], /, *args: Any, **kwargs: Any) -> "Future[T]":
        """Return a future that is done at a moment of the twin's time."""
        number = next(self._numbers)
        with self._lock:
            begins_ns = max(self._clock.now_ns(), self._free_ns)
            self._free_ns = due_ns = begins_ns + self._computing_ns
            future: _TimedFuture[T] = _TimedFuture(self._clock, begins_ns, due_ns)
            work = self._inner.submit(_fulfil, future, fn, args, kwargs)
            self._due_ns[number] = due_ns
            self._declare()
        work.add_done_callback(lambda work: self._note_done(number, work, future))
        return future

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """Take no more work."""
        self._inner.shutdown(wait=wait, cancel_futures=cancel_futures)

    def _note_done(self, number: int, work: "Future[None]", future: "_TimedFuture[Any]") -> None:
        if work.cancelled():
            future.call_off()
        with self._lock:
            del self._due_ns[number]
            self._declare()

    def _declare(self) -> None:
        """Hold time at the moment at which the oldest work is due, or not at all."""
        if self._line is None or not self._line.is_current:
            self._line = self._clock.line()
            if self._line is not None:
                self._line.send(Op.JOIN, os.getpid(), role=self._role)
        if self._line is None:
            return
        if self._due_ns:
            self._line.send(Op.HOLD, min(self._due_ns.values()))
        else:
            self._line.send(Op.RELEASE)


class _TimedFuture(Future[T]):
    """Begin and be done at moments of the twin's time; a result is waited for by the wall clock.

    What has not begun by then can be cancelled, even where the thread was early.
    """

    def __init__(self, clock: Clock, begins_ns: int, due_ns: int) -> None:
        super().__init__()
        self._clock = clock
        self._begins_ns = begins_ns
        self._due_ns = due_ns
        self._called_off = False

    def call_off(self) -> None:
        self._called_off = True
        super().cancel()

    def cancel(self) -> bool:
        if not self._called_off and self._clock.now_ns() < self._begins_ns:
            self.call_off()
        return self._called_off

    def cancelled(self) -> bool:
        return self._called_off

    def done(self) -> bool:
        return self._called_off or (super().done() and self._clock.now_ns() >= self._due_ns)

    def result(self, timeout: float | None = None) -> T:
        if self._called_off:
            raise CancelledError
        return super().result(timeout)

    def exception(self, timeout: float | None = None) -> BaseException | None:
        if self._called_off:
            raise CancelledError
        return super().exception(timeout)


def _fulfil(
    future: "_TimedFuture[T]", fn: Callable[..., T], args: tuple[Any, ...], kwargs: dict[str, Any]
) -> None:
    if not future.set_running_or_notify_cancel():
        return
    try:
        result = fn(*args, **kwargs)
    except BaseException as error:  # whoever asks the future gets it
        future.set_exception(error)
    else:
        future.set_result(result)


def worker_thread(name: str, clock: Clock, computing_s: float) -> Executor:
    """Return one thread of the same priority as the steps: for work that they wait for.

    On the twin's time a piece of work takes `computing_s`, as it may on a robot's computer.
    """
    return _timed(name, clock, computing_s, ThreadPoolExecutor(1, thread_name_prefix=name))


def low_priority_thread(clock: Clock, computing_s: float = _BACKGROUND_S) -> Executor:
    """Return one thread that lets the steps of its process go first."""
    thread = ThreadPoolExecutor(1, thread_name_prefix="prepare", initializer=_give_way)
    return _timed("background", clock, computing_s, thread)


def _timed(name: str, clock: Clock, computing_s: float, thread: ThreadPoolExecutor) -> Executor:
    return TwinWorker(name, clock, computing_s, thread) if isinstance(clock, TwinClock) else thread


def _give_way() -> None:
    """Lower this thread alone, below the main thread whose priority it has inherited."""
    os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))
    thread = 0
    inherited = os.getpriority(os.PRIO_PROCESS, thread)
    os.setpriority(os.PRIO_PROCESS, thread, max(_NICE, inherited + 1))
