"""Write one flight as an MCAP file, a few messages at a time."""

import heapq
import json
import os
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any, BinaryIO

from mcap.writer import CompressionType, Writer

from vla_deploy.ipc import BY_NAME, TOPICS, BadPayload, Kind, Record
from vla_deploy.ipc.delta import DeltaReader
from vla_deploy.telemetry.channels import TICKS, cell_text, channels_of, image_text, tick_text
from vla_deploy.telemetry.history import Kept
from vla_deploy.telemetry.judge import JUDGED_TYPES, rules_digest
from vla_deploy.telemetry.triggers import Trigger

METADATA = "flight"
_SEQUENCE_MASK = 0xFFFF_FFFF
_CHUNK_BYTES = 256 * 1024


@dataclass(frozen=True, slots=True, kw_only=True)
class FlightHead:
    """Say whose flight it is; `wall_offset_ns` turns monotonic stamps into wall clock."""

    run_id: str
    robot: str
    profile: str
    wall_offset_ns: int
    triggers: tuple[Trigger, ...]

    def metadata(self) -> dict[str, str]:
        """Return it as the file carries it: texts only."""
        causes = [{**asdict(one), "kind": one.kind.value} for one in self.triggers]
        return {
            "run_id": self.run_id,
            "robot": self.robot,
            "profile": self.profile,
            "vla_deploy": version("vla-deploy"),
            "rules": rules_digest(),
            "wall_offset_ns": str(self.wall_offset_ns),
            "causes": json.dumps(causes),
        }


def write_flight(
    path: Path,
    head: FlightHead,
    values: Sequence[tuple[str, Kept]],
    ticks: Sequence[Record],
    *,
    at_once: int,
) -> Iterator[None]:
    """Write a flight to `path`, and yield after every `at_once` messages.

    Raises:
        OSError: the disk refuses it.
    """
    with path.open("wb") as file:
        writer = _begin(file, head)
        channels = _register(writer)
        messages = _messages(values, ticks, head.wall_offset_ns)
        for count, (channel, kept, text) in enumerate(messages, start=1):
            stamp_ns = kept.stamp_ns + head.wall_offset_ns
            writer.add_message(
                channels[channel], stamp_ns, text, stamp_ns, kept.sequence & _SEQUENCE_MASK
            )
            if count % at_once == 0:
                yield
        writer.finish()  # type: ignore[no-untyped-call]
        file.flush()
        os.fsync(file.fileno())


def _begin(file: BinaryIO, head: FlightHead) -> Writer:
    writer = Writer(file, chunk_size=_CHUNK_BYTES, compression=CompressionType.ZSTD)
    writer.start(profile="", library="vla-deploy")
    writer.add_metadata(METADATA, head.metadata())
    return writer


def _register(writer: Writer) -> dict[str, int]:
    ids = {}
    for topic in TOPICS:
        for channel in channels_of(topic):
            schema = writer.register_schema(channel.schema_name, "jsonschema", channel.schema_text)
            ids[channel.topic] = writer.register_channel(channel.topic, "json", schema)
    return ids


def _messages(
    values: Sequence[tuple[str, Kept]], ticks: Sequence[Record], wall_offset_ns: int
) -> Iterator[tuple[str, Kept, bytes]]:
    told = ((channel, kept, _text(channel, kept, wall_offset_ns)) for channel, kept in values)
    yield from heapq.merge(told, _ticks(ticks), key=lambda message: message[1].stamp_ns)


def _ticks(ticks: Sequence[Record]) -> Iterator[tuple[str, Kept, bytes]]:
    reader = DeltaReader(JUDGED_TYPES)
    for record in ticks:
        kept = Kept(stamp_ns=record.stamp_ns, sequence=record.sequence, payload=record.payload)
        yield TICKS, kept, tick_text(_row(reader, record), record.payload, record.writer_pid)


def _row(reader: DeltaReader, record: Record) -> dict[str, Any] | None:
    """Return a tick's values for people to read; what cannot be read is recorded all the same."""
    try:
        return reader.row(record.payload)
    except BadPayload:
        return None


def _text(channel: str, kept: Kept, wall_offset_ns: int) -> bytes:
    topic, _, part = channel.partition("/")
    if part:
        form = {"colour": "jpeg", "depth": "png"}[part]
        return image_text(kept.stamp_ns + wall_offset_ns, kept.payload, form)
    is_cell = BY_NAME[topic].kind is Kind.CELL
    return cell_text(BY_NAME[topic], kept.payload) if is_cell else kept.payload
