"""Step the parts of a process so that a broken one takes neither the process nor the others."""

import logging
from collections import Counter
from collections.abc import Callable
from typing import Final

_TOLD_FAILURES: Final = frozenset({1, 10, 100, 1000, 10_000})


class PartGuard:
    """Run work of named parts, count what fails, and log it ever more seldom."""

    def __init__(self, log: logging.Logger) -> None:
        self.failures: Counter[str] = Counter()
        self._log = log

    def run(self, name: str, work: Callable[[], None]) -> None:
        """Do a part's work; what it raises is counted and logged."""
        try:
            work()
        except Exception:  # a process' main loop: a broken part takes neither it nor the others
            self.failures[name] += 1
            if self.failures[name] in _TOLD_FAILURES:
                self._log.exception("%s has failed %d times", name, self.failures[name])
