"""Log a file to Rerun, with the views it lacks: a flight has none, a recording those chosen."""

import json
import logging
from collections.abc import Iterator

from vla_deploy.ipc import BY_NAME
from vla_deploy.ipc.memory.layout import is_document
from vla_deploy.ipc.memory.record import Scratch
from vla_deploy.robots import load_robot
from vla_deploy.robots.errors import RobotFileError
from vla_deploy.telemetry.recorded_file import RecordedFile, RecordedMessage
from vla_deploy.telemetry.recording.request import ChannelSelection
from vla_deploy.telemetry.replay.feeder import fields_of
from vla_deploy.telemetry.rerun.entity_logger import UNFIT, EntityLogger
from vla_deploy.telemetry.schemas.views import CONSTANT_VIEWS, VIEWS_BY_TOPIC, ViewDrawer

_log = logging.getLogger(__name__)


def convert(file: RecordedFile, logger: EntityLogger, selection: ChannelSelection) -> int:
    """Log what a file holds, drawing its missing views; return the number of its messages.

    Values that are older than the file are placed at its beginning.

    Raises:
        FlightUnreadable: the file is spoiled.
    """
    views, began_ns = _MissingViews(file), file.complete_from_ns
    for channel, text in views.constant(began_ns):
        if selection.takes(channel):
            logger.add(channel, began_ns, text)
    messages = 0
    for message in file.messages_from(0):
        messages += 1
        stamp_ns = max(message.stamp_ns + file.wall_offset_ns, began_ns)
        if selection.takes(message.channel):
            logger.add(message.channel, stamp_ns, message.text)
        _add_views(message, stamp_ns, views, logger, selection)
    return messages


def _add_views(
    message: RecordedMessage,
    stamp_ns: int,
    views: "_MissingViews",
    logger: EntityLogger,
    selection: ChannelSelection,
) -> None:
    try:
        for channel, text in views.of(message.channel, message.text, stamp_ns):
            if selection.takes(channel):
                logger.add(channel, stamp_ns, text)
    except UNFIT as error:
        logger.leave_out(f"views of {message.channel}", error)


class _MissingViews:
    """Draw the views that a file lacks, if this computer has the robot file."""

    def __init__(self, file: RecordedFile) -> None:
        self._counts = file.counts
        lacking = any(self._lacks(view.channel) for view in CONSTANT_VIEWS) or any(
            self._lacks_any_of(topic) for topic, count in file.counts.items() if count
        )
        self._drawer = _drawer(file.robot) if lacking else None

    def constant(self, stamp_ns: int) -> Iterator[tuple[str, bytes]]:
        """Yield channel and JSON of the constant views; `stamp_ns` is wall clock."""
        if self._drawer is not None:
            yield from self._drawer.constant_views(stamp_ns, self._lacks)

    def of(self, channel: str, text: bytes, stamp_ns: int) -> Iterator[tuple[str, bytes]]:
        """Yield channel and JSON of the views of one message.

        Raises:
            Exception: the message is not what its channel says.
        """
        if self._drawer is not None and self._lacks_any_of(channel):
            yield from self._drawer.views_of(
                channel, _payload(channel, text), stamp_ns, self._lacks
            )

    def _lacks(self, channel: str) -> bool:
        return not self._counts.get(channel)

    def _lacks_any_of(self, topic: str) -> bool:
        return any(self._lacks(view.channel) for view in VIEWS_BY_TOPIC.get(topic, ()))


def _payload(channel: str, text: bytes) -> bytes:
    """Return a cell's payload as its topic carried it."""
    topic = BY_NAME[channel]
    if is_document(topic):
        return text
    scratch = Scratch(topic)
    scratch.fill(fields_of(topic, json.loads(text)))
    return bytes(scratch.payload)


def _drawer(robot: str) -> ViewDrawer | None:
    try:
        return ViewDrawer(load_robot(robot))
    except RobotFileError as error:
        _log.warning("no views that the file lacks: %s", error)
        return None
