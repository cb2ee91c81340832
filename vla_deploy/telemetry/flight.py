"""Read a recorded flight: who, why, and every message in order."""

import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from mcap.reader import McapReader, make_reader

from vla_deploy.telemetry.errors import FlightUnreadable
from vla_deploy.telemetry.history import KEPT_NS
from vla_deploy.telemetry.mcap_file import SPOILED
from vla_deploy.telemetry.writing import METADATA


@dataclass(frozen=True, slots=True, kw_only=True)
class Message:
    """Carry one message; `stamp_ns` is monotonic, in the run's clock."""

    topic: str
    stamp_ns: int
    text: bytes

    def document(self) -> dict[str, Any]:
        """Return the JSON object."""
        document: dict[str, Any] = json.loads(self.text)
        return document


@dataclass(frozen=True, slots=True, kw_only=True)
class Flight:
    """Describe one file; `counts` is the number of messages per topic.

    It starts where everything is remembered from; a topic that seldom changes has an older value.
    """

    path: Path
    run_id: str
    robot: str
    profile: str
    version: str
    rules: str
    wall_offset_ns: int
    causes: tuple[dict[str, Any], ...]
    counts: dict[str, int]
    start_ns: int
    end_ns: int

    def messages(self, *topics: str) -> Iterator[Message]:
        """Return the messages of some topics by time, or of all.

        Raises:
            FlightUnreadable: the file is cut off or spoiled.
        """
        with self.path.open("rb") as file:
            try:
                for _, channel, message in make_reader(file, validate_crcs=True).iter_messages(
                    topics=topics or None
                ):
                    yield Message(
                        topic=channel.topic,
                        stamp_ns=message.log_time - self.wall_offset_ns,
                        text=message.data,
                    )
            except SPOILED as error:
                raise _unreadable(self.path, error) from error


def read_flight(path: Path) -> Flight:
    """Read what a flight says of itself.

    Raises:
        FlightUnreadable: the file cannot be opened, is cut off, spoiled, or no flight.
    """
    try:
        with path.open("rb") as file:
            return _describe(path, make_reader(file, validate_crcs=True))
    except OSError as error:
        raise FlightUnreadable(f"{path}: {error.strerror}") from error
    except SPOILED as error:
        raise _unreadable(path, error) from error


def _describe(path: Path, reader: McapReader) -> Flight:
    metadata = {record.name: record.metadata for record in reader.iter_metadata()}[METADATA]
    summary = reader.get_summary()
    if summary is None or summary.statistics is None:
        raise ValueError("it has no summary")
    statistics = summary.statistics
    counts = {
        summary.channels[channel].topic: count
        for channel, count in statistics.channel_message_counts.items()
    }
    offset_ns = int(metadata["wall_offset_ns"])
    end_ns = statistics.message_end_time - offset_ns
    return Flight(
        path=path,
        run_id=metadata["run_id"],
        robot=metadata["robot"],
        profile=metadata["profile"],
        version=metadata["vla_deploy"],
        rules=metadata.get("rules", ""),
        wall_offset_ns=offset_ns,
        causes=tuple(json.loads(metadata["causes"])),
        counts=counts,
        start_ns=max(statistics.message_start_time - offset_ns, end_ns - KEPT_NS),
        end_ns=end_ns,
    )


def _unreadable(path: Path, error: Exception) -> FlightUnreadable:
    reason = str(error) or type(error).__name__
    return FlightUnreadable(
        f"{path}: no whole flight: {reason}; expected an MCAP file of the flight recorder, see: "
        "vla-deploy flight list"
    )
