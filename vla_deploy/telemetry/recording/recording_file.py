"""Write one file of a recording."""

import contextlib
from collections.abc import Iterable
from pathlib import Path
from typing import Final

from vla_deploy.runtime.node import NodeContext
from vla_deploy.telemetry.channels import TOPIC_CHANNELS, Channel
from vla_deploy.telemetry.mcap_file import RECORDING, McapFile, run_metadata
from vla_deploy.telemetry.recording.messages import DraftMessage
from vla_deploy.telemetry.recording.request import ChannelSelection
from vla_deploy.telemetry.schemas.views import CHANNELS

ALL_CHANNELS: Final[tuple[Channel, ...]] = (*TOPIC_CHANNELS, *CHANNELS)
"""The channels of every topic and every view."""


class RecordingFile:
    """Hold one open file; messages older than it are placed at its beginning."""

    def __init__(
        self,
        path: Path,
        context: NodeContext,
        selection: ChannelSelection,
        began_ns: int,
        offset_ns: int,
    ) -> None:
        """Begin a file at a moment of the run's clock; adding `offset_ns` gives wall clock.

        Raises:
            OSError: the disk refuses it.
        """
        self.path = path
        self.began_ns = began_ns
        self.offset_ns = offset_ns
        self.messages = 0
        self._stream = path.open("wb")
        try:
            channels = [one for one in ALL_CHANNELS if selection.takes(one.topic)]
            metadata = {**run_metadata(context), "wall_offset_ns": str(offset_ns)}
            self._mcap = McapFile(self._stream, channels, RECORDING, metadata)
        except OSError:
            self._stream.close()
            raise

    def add(self, messages: Iterable[DraftMessage]) -> None:
        """Add messages.

        Raises:
            OSError: the disk refuses it.
        """
        for one in messages:
            published_ns = one.stamp_ns + self.offset_ns
            stamp_ns = max(one.stamp_ns, self.began_ns) + self.offset_ns
            self._mcap.add(one.channel, stamp_ns, one.text, one.sequence, published_ns)
            self.messages += 1

    def flush(self) -> int:
        """Flush everything to the kernel and return the file's size in bytes.

        Raises:
            OSError: the disk refuses it.
        """
        self._mcap.flush()
        return self._stream.tell()

    def finish(self) -> None:
        """Write the index and close the file.

        Raises:
            OSError: the disk refuses it.
        """
        try:
            self._mcap.finish()
        finally:
            self._stream.close()

    def abandon(self) -> None:
        """Close a file that the disk refuses; its whole messages can be recovered."""
        with contextlib.suppress(OSError):  # it closes the file all the same
            self._stream.close()
