"""Log messages to Rerun as entities, and count those that cannot be drawn."""

import logging
from collections import Counter
from typing import Any, Final, Protocol

from vla_deploy.ipc import BadPayload
from vla_deploy.telemetry.rerun.entity import Entity
from vla_deploy.telemetry.rerun.table import MessageDrawer

# Raised by messages of another version, or malformed ones.
UNFIT: Final = (
    BadPayload,
    ValueError,
    TypeError,
    LookupError,
    AttributeError,
    OverflowError,
)
_log = logging.getLogger(__name__)


class EntityStream(Protocol):
    """Take entities."""

    def at(self, stamp_ns: int, tick: int | None) -> None:
        """Set the time of what follows: wall clock, and control's tick if there is one."""
        ...

    def log(self, entity: Entity) -> None:
        """Take one entity."""
        ...

    def flush(self) -> None:
        """Wait until everything is written or sent.

        Raises:
            ExtraMissing: it cannot be.
        """
        ...


class EntityLogger:
    """Log the messages of one file or of one run.

    `shown` counts what was logged, by path; `unfit` what was left out, by channel.
    """

    def __init__(self, stream: EntityStream) -> None:
        self.shown: Counter[str] = Counter()
        self.unfit: Counter[str] = Counter()
        self._stream = stream
        self._drawer = MessageDrawer()
        self._static: dict[tuple[str, str], Any] = {}

    def add(self, channel: str, stamp_ns: int, text: bytes) -> None:
        """Log one message, or count it as unfit; `stamp_ns` is wall clock."""
        try:
            drawn = self._drawer.draw(channel, text)
            self._stream.at(stamp_ns, drawn.tick)
            for entity in drawn.entities:
                self._log(entity)
        except UNFIT as error:
            self.leave_out(channel, error)

    def flush(self) -> None:
        """Wait until everything that was added is written or sent.

        Raises:
            ExtraMissing: it cannot be, as with a viewer that was closed.
        """
        self._stream.flush()

    def leave_out(self, what: str, error: Exception) -> None:
        """Count what cannot be drawn; the first of its kind is logged as a warning."""
        if not self.unfit[what]:
            _log.warning("%s: left out: %s: %s", what, type(error).__name__, error)
        self.unfit[what] += 1

    def _log(self, entity: Entity) -> None:
        """Log an entity; a static one only when it has changed."""
        if entity.static:
            key = entity.path, entity.archetype
            if self._static.get(key) == entity.values:
                return
            self._static[key] = entity.values
        self._stream.log(entity)
        self.shown[entity.path] += 1
