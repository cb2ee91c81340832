"""Make a whole file of one whose writer was killed: every whole chunk of it is kept."""

import logging
from collections.abc import Iterator
from pathlib import Path

from mcap.records import Channel, McapRecord, Message, Metadata, Schema
from mcap.stream_reader import StreamReader
from mcap.writer import CompressionType, Writer

from vla_deploy.telemetry.mcap_file import SPOILED

_log = logging.getLogger(__name__)


def recover(cut: Path, to: Path) -> int:
    """Write what is whole of `cut` to `to`, and return how many messages that are.

    Raises:
        OSError: the disk refuses it.
    """
    messages = 0
    with cut.open("rb") as source, to.open("wb") as file:
        writer = Writer(file, compression=CompressionType.ZSTD)
        writer.start(profile="", library="vla-deploy")
        ids: dict[int, int] = {}
        schemas: dict[int, int] = {}
        for record in _whole_records(StreamReader(source)):
            match record:
                case Metadata():
                    writer.add_metadata(record.name, record.metadata)
                case Schema() if record.id not in schemas:
                    schemas[record.id] = writer.register_schema(
                        record.name, record.encoding, record.data
                    )
                case Channel() if record.id not in ids:
                    ids[record.id] = writer.register_channel(
                        record.topic, record.message_encoding, schemas[record.schema_id]
                    )
                case Message():
                    messages += 1
                    writer.add_message(
                        ids[record.channel_id],
                        record.log_time,
                        record.data,
                        record.publish_time,
                        record.sequence,
                    )
        writer.finish()  # type: ignore[no-untyped-call]
    return messages


def _whole_records(reader: StreamReader) -> Iterator[McapRecord]:
    try:
        yield from reader.records
    except SPOILED as error:
        _log.info("recovering: the file ends with %s", str(error) or type(error).__name__)
