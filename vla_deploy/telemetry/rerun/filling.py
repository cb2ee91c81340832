"""Draw the views that a file lacks: a flight has none, and a recording those that were chosen."""

import logging
from collections.abc import Iterator, Mapping
from typing import Final

from vla_deploy.ipc import BY_NAME
from vla_deploy.ipc.memory.layout import is_document
from vla_deploy.ipc.memory.record import Scratch
from vla_deploy.robots import load_robot
from vla_deploy.robots.errors import RobotFileError
from vla_deploy.telemetry.recording.summary import Summary
from vla_deploy.telemetry.replay.decoding import document_of, fields_of
from vla_deploy.telemetry.schemas.pictures import Pictures
from vla_deploy.telemetry.schemas.views import STILL, VIEWS

_VIEWS: Final[Mapping[str, tuple[str, ...]]] = {
    topic: tuple(view.channel for view in VIEWS if view.topic == topic)
    for topic in {view.topic for view in VIEWS}
}
_STILL: Final = tuple(still.channel for still in STILL)
_log = logging.getLogger(__name__)


class Filling:
    """Draw views from what a file holds; none where this computer does not have the robot file."""

    def __init__(self, summary: Summary) -> None:
        counts = summary.counts
        self._lacks = lambda channel: not counts.get(channel)
        lacking = [view.channel for view in VIEWS if counts.get(view.topic)] + list(_STILL)
        self._pictures = _pictures(summary.robot) if any(map(self._lacks, lacking)) else None

    def still(self, stamp_ns: int) -> Iterator[tuple[str, bytes]]:
        """Yield channel and JSON of what stays as it is; `stamp_ns` is wall clock."""
        if self._pictures is not None:
            yield from self._pictures.still(stamp_ns, self._lacks)

    def of(self, channel: str, text: bytes, stamp_ns: int) -> Iterator[tuple[str, bytes]]:
        """Yield channel and JSON of the views of one message.

        Raises:
            Exception: the message is not what its channel says.
        """
        if self._pictures is not None and any(map(self._lacks, _VIEWS.get(channel, ()))):
            yield from self._pictures.of(channel, _payload(channel, text), stamp_ns, self._lacks)


def _payload(channel: str, text: bytes) -> bytes:
    """Return a cell's value as the topic carried it."""
    topic = BY_NAME[channel]
    if is_document(topic):
        return text
    scratch = Scratch(topic)
    scratch.fill(fields_of(topic, document_of(text)))
    return bytes(scratch.payload)


def _pictures(robot: str) -> Pictures | None:
    try:
        return Pictures(load_robot(robot))
    except RobotFileError as error:
        _log.warning("no views that the file lacks: %s", error)
        return None
