"""Follow the logs of every process of a run, as messages that a viewer's log panel shows."""

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from vla_deploy.supervisor.runs.log_files import LogTail, processes_in
from vla_deploy.telemetry.schemas.geometry import time_json

_LEVELS: Final[Mapping[str, int]] = {
    "DEBUG": 1,
    "INFO": 2,
    "WARNING": 3,
    "ERROR": 4,
    "CRITICAL": 5,
}
_UNKNOWN: Final = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class LoggedLine:
    """Carry one line; `stamp_ns` is in the run's clock."""

    stamp_ns: int
    line: Mapping[str, Any]

    def text(self, wall_offset_ns: int) -> bytes:
        """Return it as `foxglove.Log`; `wall_offset_ns` turns the stamp into wall clock."""
        line = self.line
        message = {
            "timestamp": time_json(self.stamp_ns + wall_offset_ns),
            "level": _LEVELS.get(str(line.get("level")), _UNKNOWN),
            "message": "\n".join(str(line[key]) for key in ("message", "traceback") if key in line),
            "name": str(line.get("process", "")),
            "file": str(line.get("file", "")),
            "line": int(line.get("line", 0)),
        }
        return json.dumps(message).encode()


class RunLogs:
    """Yield what the processes have logged since the last look; at first, all that is there."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._tails: dict[str, LogTail] = {}

    def fresh(self) -> Iterator[LoggedLine]:
        """Yield the new lines, the oldest first."""
        for process in processes_in(self._folder):
            self._tails.setdefault(process, LogTail(self._folder, process))
        lines = [line for tail in self._tails.values() for line in tail.fresh()]
        for line in sorted(lines, key=_stamp_ns):
            yield LoggedLine(stamp_ns=_stamp_ns(line), line=line)


def _stamp_ns(line: Mapping[str, Any]) -> int:
    stamp = line.get("stamp_ns")
    return stamp if isinstance(stamp, int) else 0
