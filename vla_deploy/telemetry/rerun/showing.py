"""Show messages: draw each by the table, hand it on, and count what does not fit."""

import logging
from collections import Counter
from typing import Any, Final, Protocol

from vla_deploy.ipc import BadPayload
from vla_deploy.telemetry.rerun.entity import Entity
from vla_deploy.telemetry.rerun.table import Table

# What a message raises that another version wrote, or nobody should have.
ODD: Final = (
    BadPayload,
    ValueError,
    TypeError,
    LookupError,
    AttributeError,
    OverflowError,
)
_log = logging.getLogger(__name__)


class Stream(Protocol):
    """Take entities."""

    def at(self, stamp_ns: int, tick: int | None) -> None:
        """Set the moment of what follows: wall clock, and control's tick if there is one."""
        ...

    def log(self, entity: Entity) -> None:
        """Take one entity."""
        ...

    def flush(self) -> None:
        """Wait until everything is where it belongs.

        Raises:
            ExtraMissing: it cannot be.
        """
        ...


class Showing:
    """Show the messages of one file or of one run.

    `shown` counts what was logged, by path; `unfit` what was left out, by channel.
    """

    def __init__(self, stream: Stream) -> None:
        self.shown: Counter[str] = Counter()
        self.unfit: Counter[str] = Counter()
        self._stream = stream
        self._table = Table()
        self._static: dict[tuple[str, str], Any] = {}

    def add(self, channel: str, stamp_ns: int, text: bytes) -> None:
        """Show one message; `stamp_ns` is wall clock. What does not fit is left out, counted."""
        try:
            drawn = self._table.drawn(channel, text)
            self._stream.at(stamp_ns, drawn.tick)
            for entity in drawn.entities:
                self._log(entity)
        except ODD as error:
            self.leave_out(channel, error)

    def flush(self) -> None:
        """Wait until everything that was added is where it belongs.

        Raises:
            ExtraMissing: it cannot be, as with a viewer that was closed.
        """
        self._stream.flush()

    def leave_out(self, what: str, error: Exception) -> None:
        """Count something that cannot be shown; the first of its kind is told."""
        if not self.unfit[what]:
            _log.warning("%s: left out: %s: %s", what, type(error).__name__, error)
        self.unfit[what] += 1

    def _log(self, entity: Entity) -> None:
        """Hand on an entity; what holds at every time is told once, until it is another."""
        if entity.static:
            key = entity.path, entity.archetype
            if self._static.get(key) == entity.values:
                return
            self._static[key] = entity.values
        self._stream.log(entity)
        self.shown[entity.path] += 1
