"""Keep recordings in a bounded folder, and recover the files of a recorder that was killed."""

import logging
from collections.abc import Iterator
from pathlib import Path

from mcap.records import Channel, McapRecord, Message, Metadata, Schema
from mcap.stream_reader import StreamReader
from mcap.writer import CompressionType, Writer

from vla_deploy.runtime.state_dir import library_dir_of
from vla_deploy.telemetry.folder import NumberedFolder, final_name
from vla_deploy.telemetry.mcap_file import SPOILED

_log = logging.getLogger(__name__)


def recordings_dir_of(base: Path) -> Path:
    """Return where the runs of a runtime directory leave their recordings."""
    return library_dir_of(base) / "recordings"


class RecordingFolder(NumberedFolder):
    """Keep the recordings of one folder."""

    noun = "recording"
    verb = "record"

    def sweep(self) -> None:
        """Recover the files of a killed recorder; delete those without any whole message."""
        for half in self.path.glob(".*.mcap.whole"):
            half.unlink(missing_ok=True)
        for part in self.unfinished_files():
            whole = part.with_name(part.name.replace(".mcap.part", ".mcap.whole"))
            try:
                messages = recover(part, whole)
                if messages:
                    whole.rename(part.with_name(final_name(part)))
                part.unlink()
                _log.info("recovered %d messages of %s", messages, final_name(part))
            except OSError as error:
                _log.warning("%s is not recovered: %s; it stays", part, error.strerror)
            finally:
                whole.unlink(missing_ok=True)


def recover(cut: Path, to: Path) -> int:
    """Write the whole messages of `cut` to `to`, and return their number.

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
