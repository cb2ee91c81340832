"""Write one flight as an MCAP file, a few messages at a time."""

import heapq
import json
from collections.abc import Iterator, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from vla_deploy.ipc import BadPayload, Record
from vla_deploy.ipc.memory.delta import DeltaReader
from vla_deploy.runtime.node import NodeContext
from vla_deploy.telemetry.channels import (
    TICKS,
    TOPIC_CHANNELS,
    ChannelValue,
    TopicValue,
    tick_text,
    value_text,
)
from vla_deploy.telemetry.judge import JUDGED_TYPES, rules_digest
from vla_deploy.telemetry.mcap_file import FLIGHT, McapFile, run_metadata
from vla_deploy.telemetry.triggers import FlightTrigger


def write_flight(
    path: Path,
    context: NodeContext,
    triggers: Sequence[FlightTrigger],
    values: Sequence[ChannelValue],
    ticks: Sequence[Record],
    *,
    wall_offset_ns: int,
    at_once: int,
) -> Iterator[None]:
    """Write a flight to `path`, and yield after every `at_once` messages.

    Adding `wall_offset_ns` to stamps gives wall clock.

    Raises:
        OSError: the disk refuses it.
    """
    metadata = {
        **run_metadata(context),
        "rules": rules_digest(),
        "wall_offset_ns": str(wall_offset_ns),
        "causes": json.dumps([{**asdict(one), "kind": one.kind.value} for one in triggers]),
    }
    with path.open("wb") as file:
        mcap = McapFile(file, TOPIC_CHANNELS, FLIGHT, metadata)
        messages = _messages(values, ticks, wall_offset_ns)
        for count, (channel, value, text) in enumerate(messages, start=1):
            mcap.add(channel, value.stamp_ns + wall_offset_ns, text, value.sequence)
            if count % at_once == 0:
                yield
        mcap.finish()


def _messages(
    values: Sequence[ChannelValue], ticks: Sequence[Record], wall_offset_ns: int
) -> Iterator[tuple[str, TopicValue, bytes]]:
    texts = (
        (channel, value, value_text(channel, value, wall_offset_ns)) for channel, value in values
    )
    yield from heapq.merge(texts, _ticks(ticks), key=lambda message: message[1].stamp_ns)


def _ticks(ticks: Sequence[Record]) -> Iterator[tuple[str, TopicValue, bytes]]:
    reader = DeltaReader(JUDGED_TYPES)
    for record in ticks:
        value = TopicValue(
            stamp_ns=record.stamp_ns, sequence=record.sequence, payload=record.payload
        )
        yield TICKS, value, tick_text(_row(reader, record), record.payload, record.writer_pid)


def _row(reader: DeltaReader, record: Record) -> dict[str, Any] | None:
    """Return a tick's values for people, or None; the record is written in any case."""
    try:
        return reader.row(record.payload)
    except BadPayload:
        return None
