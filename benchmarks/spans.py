"""Charge a thread's CPU time to named parts of a step, each part without those inside it."""

import time
from collections import Counter, defaultdict
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Final, ParamSpec, TypeVar

P = ParamSpec("P")
R = TypeVar("R")

REST: Final = "rest"


@dataclass(slots=True)
class Tally:
    """Sum up the steps of one kind, and the CPU time of each part."""

    steps: int = 0
    cpu_ns: Counter[str] = field(default_factory=Counter)


class Spans:
    """Time calls that are made within `step`; all others pass through."""

    def __init__(self) -> None:
        self.steps = 0
        self.cpu_ns: Counter[str] = Counter()
        self.kinds: defaultdict[str, Tally] = defaultdict(Tally)
        self._step_ns: Counter[str] = Counter()
        self._open: list[str] = []
        self._since_ns = 0
        self._wrapped: list[tuple[Any, str, Any]] = []

    def step(
        self, call: Callable[[], None], kind_of_step: Callable[[], str] = lambda: ""
    ) -> Callable[[], None]:
        """Return the call, timed as one step; `kind_of_step` names, after it, what it was."""

        def stepped() -> None:
            self._open.append(REST)
            self._since_ns = time.thread_time_ns()
            try:
                call()
            finally:
                self._charge()
                self._open.pop()
                self._sum_up(self.kinds[kind_of_step()])

        return stepped

    def wrap(self, part: str, owner: Any, name: str) -> None:
        """Time what `owner` calls `name` as a part of the step."""
        before = getattr(owner, name)
        self._wrapped.append((owner, name, before))
        setattr(owner, name, self._part(part, before))

    def close(self) -> None:
        """Put back what was wrapped."""
        while self._wrapped:
            setattr(*self._wrapped.pop())

    def _part(self, part: str, call: Callable[P, R]) -> Callable[P, R]:
        def timed(*args: P.args, **kwargs: P.kwargs) -> R:
            if not self._open:
                return call(*args, **kwargs)
            self._charge()
            self._open.append(part)
            try:
                return call(*args, **kwargs)
            finally:
                self._charge()
                self._open.pop()

        return timed

    def _sum_up(self, tally: Tally) -> None:
        self.steps += 1
        self.cpu_ns += self._step_ns
        tally.steps += 1
        tally.cpu_ns += self._step_ns
        self._step_ns.clear()

    def _charge(self) -> None:
        now_ns = time.thread_time_ns()
        self._step_ns[self._open[-1]] += now_ns - self._since_ns
        self._since_ns = now_ns
