"""Tell what a session costs, for budgets and status."""

import os
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Final

from vla_deploy.inference.manifest import Variant

_BYTES_PER_MB: Final = 2**20
_PAGE_BYTES: Final = os.sysconf("SC_PAGE_SIZE")


@dataclass(frozen=True, slots=True, kw_only=True)
class SessionStats:
    """Hold what one session is and what it has cost so far.

    `memory_mb` is by how much the process grew while the session was opened and warmed up; other
    threads of the process may have a share in it. `busy_s` is the time of all runs. `notices`
    tell where it is not as was asked.
    """

    model: str
    role: str
    variant: Variant
    provider: str
    threads: int
    runs: int
    busy_s: float
    failures: int
    p50_s: float
    p95_s: float
    max_s: float
    load_s: float
    memory_mb: float
    notices: tuple[str, ...]

    def document(self) -> dict[str, Any]:
        """Return the values for a status topic, as JSON takes them."""
        return {**asdict(self), "notices": list(self.notices)}


def resident_mb() -> float:
    """Return how much memory this process holds."""
    resident_pages = int(Path("/proc/self/statm").read_text().split()[1])
    return resident_pages * _PAGE_BYTES / _BYTES_PER_MB
