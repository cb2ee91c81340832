"""Write MCAP files of JSON messages in zstd chunks; list what a spoiled file raises."""

import os
import struct
from collections.abc import Iterable, Mapping
from importlib.metadata import version
from typing import BinaryIO, Final

from mcap.exceptions import McapError
from mcap.writer import CompressionType, Writer
from zstandard import ZstdError

from vla_deploy.runtime.node import NodeContext
from vla_deploy.telemetry.channels import Channel

# Raised by the library and its decompressors on bytes that are no MCAP; lz4: RuntimeError.
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


def run_metadata(context: NodeContext) -> dict[str, str]:
    """Return what every file says of the run that it is of."""
    return {
        "run_id": context.run_dir.resolve().name,
        "robot": context.robot,
        "profile": context.profile,
        "vla_deploy": version("vla-deploy"),
    }


class McapFile:
    """Write messages to an open file, each on a channel declared before."""

    def __init__(
        self, file: BinaryIO, channels: Iterable[Channel], name: str, metadata: Mapping[str, str]
    ) -> None:
        """Begin the file with its metadata.

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
        """Write a whole chunk to the kernel, so that it outlives a killed process.

        Raises:
            OSError: the disk refuses it.
        """
        # The library ends a chunk by size only: with few messages that takes minutes.
        self._writer._Writer__finalize_chunk()  # type: ignore[attr-defined]
        self._file.flush()

    def finish(self) -> None:
        """Write the index, and sync the file to the disk.

        Raises:
            OSError: the disk refuses it.
        """
        self._writer.finish()  # type: ignore[no-untyped-call]
        self._file.flush()
        os.fsync(self._file.fileno())
