"""Write an MCAP file of JSON messages in zstd chunks, and know what a spoiled one raises."""

import os
import struct
from collections.abc import Iterable, Mapping
from typing import BinaryIO, Final

from mcap.exceptions import McapError
from mcap.writer import CompressionType, Writer
from zstandard import ZstdError

from vla_deploy.telemetry.channels import Channel

# What the library and what it unpacks with raise on bytes that are no MCAP; lz4: RuntimeError.
SPOILED: Final = (
    McapError,
    struct.error,
    ZstdError,
    RuntimeError,
    ValueError,
    KeyError,
    EOFError,
)
FLIGHT: Final = "flight"
RECORDING: Final = "recording"
_SEQUENCE_MASK: Final = 0xFFFF_FFFF
_CHUNK_BYTES: Final = 256 * 1024


class McapFile:
    """Write messages to an open file, each on a channel that was declared for it."""

    def __init__(
        self, file: BinaryIO, channels: Iterable[Channel], name: str, metadata: Mapping[str, str]
    ) -> None:
        """Begin the file with what it says of itself.

        Raises:
            OSError: the disk refuses it.
        """
        self._file = file
        self._writer = Writer(file, chunk_size=_CHUNK_BYTES, compression=CompressionType.ZSTD)
        self._writer.start(profile="", library="vla-deploy")
        self._writer.add_metadata(name, dict(metadata))
        self._ids: dict[str, int] = {}
        for channel in channels:
            schema = self._writer.register_schema(
                channel.schema_name, "jsonschema", channel.schema_text
            )
            self._ids[channel.topic] = self._writer.register_channel(channel.topic, "json", schema)

    def add(
        self,
        channel: str,
        stamp_ns: int,
        text: bytes,
        sequence: int = 0,
        published_ns: int | None = None,
    ) -> None:
        """Add one message; stamps are wall clock, `published_ns` that of its value.

        Raises:
            OSError: the disk refuses it.
        """
        self._writer.add_message(
            self._ids[channel],
            stamp_ns,
            text,
            stamp_ns if published_ns is None else published_ns,
            sequence & _SEQUENCE_MASK,
        )

    def flush(self) -> None:
        """Hand what there is to the kernel, as a whole chunk: a killed process leaves it.

        Raises:
            OSError: the disk refuses it.
        """
        # The library ends a chunk by size only; one of few messages would wait for minutes.
        self._writer._Writer__finalize_chunk()  # type: ignore[attr-defined]
        self._file.flush()

    def finish(self) -> None:
        """Write the index and everything to the disk.

        Raises:
            OSError: the disk refuses it.
        """
        self._writer.finish()  # type: ignore[no-untyped-call]
        self._file.flush()
        os.fsync(self._file.fileno())
