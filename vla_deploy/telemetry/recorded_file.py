"""Read the files of the recorders, flights and recordings: what each is of, and its messages."""

import json
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Any, Final

from mcap.reader import McapReader, make_reader

from drivers.clock import NS_PER_S
from vla_deploy.telemetry.errors import FlightUnreadable
from vla_deploy.telemetry.mcap_file import FLIGHT, RECORDING, SPOILED
from vla_deploy.telemetry.triggers import KEPT_NS

# By the kinds that are expected: how the file is named, and where such files are listed.
_EXPECTED: Final[Mapping[tuple[str, ...], tuple[str, str]]] = {
    (FLIGHT,): ("flight", "the flight recorder, see: vla-deploy flight list"),
    (RECORDING, FLIGHT): (
        "recording",
        "this project, see: vla-deploy record list, vla-deploy flight list",
    ),
}


@dataclass(frozen=True, slots=True, kw_only=True)
class RecordedMessage:
    """Carry one message.

    `at_ns` is its place in the file in wall clock, `stamp_ns` its stamp in the run's clock.
    `sequence` is that of the value; the parts of one image have the same.
    """

    channel: str
    at_ns: int
    stamp_ns: int
    sequence: int
    text: bytes

    def document(self) -> dict[str, Any]:
        """Return the JSON object."""
        document: dict[str, Any] = json.loads(self.text)
        return document


@dataclass(frozen=True, slots=True, kw_only=True)
class RecordedFile:
    """Describe one file, a "flight" or a "recording".

    `began_ns` and `ended_ns` are wall clock, `counts` is the number of messages per channel.
    """

    path: Path
    kind: str
    run_id: str
    robot: str
    profile: str
    version: str
    rules: str
    wall_offset_ns: int
    began_ns: int
    ended_ns: int
    counts: Mapping[str, int]
    causes: tuple[Mapping[str, Any], ...]

    @property
    def duration_s(self) -> float:
        """Return the time from the first message to the last."""
        return (self.ended_ns - self.began_ns) / NS_PER_S

    @property
    def complete_from_ns(self) -> int:
        """Return the wall clock from which on the file is complete.

        In a flight, a topic that seldom changes has an older value, perhaps hours old.
        """
        return max(self.began_ns, self.ended_ns - KEPT_NS) if self.kind == FLIGHT else self.began_ns

    @property
    def start_ns(self) -> int:
        """Return from when on the file is complete, in the run's clock."""
        return self.complete_from_ns - self.wall_offset_ns

    @property
    def end_ns(self) -> int:
        """Return the end in the run's clock."""
        return self.ended_ns - self.wall_offset_ns

    def document(self) -> dict[str, Any]:
        """Return it for JSON; `began_s` is in Unix seconds."""
        return {
            "name": self.path.name,
            "bytes": self.path.stat().st_size,
            "kind": self.kind,
            "run_id": self.run_id,
            "robot": self.robot,
            "profile": self.profile,
            "version": self.version,
            "began_s": round(self.began_ns / NS_PER_S, 3),
            "duration_s": round(self.duration_s, 3),
            "messages": sum(self.counts.values()),
            "causes": [str(cause["what"]) for cause in self.causes],
        }

    def messages(self, *channels: str) -> Iterator[RecordedMessage]:
        """Yield the messages of some channels by time, or of all; checksums are verified.

        Raises:
            FlightUnreadable: the file is cut off or spoiled.
        """
        return self._read(verify=True, topics=channels or None)

    def messages_between(
        self, from_ns: int, to_ns: int, *channels: str
    ) -> Iterator[RecordedMessage]:
        """Yield the messages of some channels between two moments of the wall clock, by time.

        Raises:
            FlightUnreadable: the file is spoiled.
        """
        return self._read(verify=True, topics=channels, starting_at=from_ns, ending_before=to_ns)

    def messages_from(self, at_ns: int) -> Iterator[RecordedMessage]:
        """Yield the messages from a moment of the wall clock on, by time.

        Raises:
            FlightUnreadable: the file is spoiled.
        """
        return self._read(starting_at=at_ns)

    def last_before(self, at_ns: int, channels: Iterable[str]) -> Iterator[RecordedMessage]:
        """Yield the last message of each channel before a moment of the wall clock.

        Raises:
            FlightUnreadable: the file is spoiled.
        """
        for channel in channels:
            if self.counts.get(channel):
                backwards = self._read(topics=[channel], ending_before=at_ns, reverse=True)
                yield from islice(backwards, 1)

    def _read(self, *, verify: bool = False, **choice: object) -> Iterator[RecordedMessage]:
        # Opened for each reading: one may begin while another goes on.
        with self.path.open("rb") as file:
            try:
                reader = make_reader(file, validate_crcs=verify)
                for _, channel, message in reader.iter_messages(**choice):  # type: ignore[arg-type]
                    yield RecordedMessage(
                        channel=channel.topic,
                        at_ns=message.log_time,
                        stamp_ns=message.publish_time - self.wall_offset_ns,
                        sequence=message.sequence,
                        text=message.data,
                    )
            except SPOILED as error:
                raise _unreadable(self.path, error, (RECORDING, FLIGHT)) from error


def read_file(path: Path) -> RecordedFile:
    """Read what a recording or a flight says of itself, from its index alone.

    Raises:
        FlightUnreadable: it cannot be opened, is cut off, spoiled, or not recorded by us.
    """
    return _open(path, (RECORDING, FLIGHT))


def read_flight(path: Path) -> RecordedFile:
    """Read what a flight says of itself; checksums are verified.

    Raises:
        FlightUnreadable: the file cannot be opened, is cut off, spoiled, or no flight.
    """
    return _open(path, (FLIGHT,), verify=True)


def _open(path: Path, kinds: tuple[str, ...], *, verify: bool = False) -> RecordedFile:
    try:
        with path.open("rb") as file:
            return _describe(path, make_reader(file, validate_crcs=verify), kinds)
    except OSError as error:
        raise FlightUnreadable(f"{path}: {error.strerror}") from error
    except SPOILED as error:
        raise _unreadable(path, error, kinds) from error


def _describe(path: Path, reader: McapReader, kinds: tuple[str, ...]) -> RecordedFile:
    metadata = {record.name: record.metadata for record in reader.iter_metadata()}
    kind = next((name for name in kinds if name in metadata), None)
    summary = reader.get_summary()
    if kind is None or summary is None or summary.statistics is None:
        raise ValueError("it has no index, or not what our recordings say of themselves")
    head, statistics = metadata[kind], summary.statistics
    return RecordedFile(
        path=path,
        kind=kind,
        run_id=head["run_id"],
        robot=head["robot"],
        profile=head["profile"],
        version=head["vla_deploy"],
        rules=head.get("rules", ""),
        wall_offset_ns=int(head["wall_offset_ns"]),
        began_ns=statistics.message_start_time,
        ended_ns=statistics.message_end_time,
        counts={
            summary.channels[channel].topic: count
            for channel, count in statistics.channel_message_counts.items()
        },
        causes=tuple(json.loads(head.get("causes", "[]"))),
    )


def _unreadable(path: Path, error: Exception, kinds: tuple[str, ...]) -> FlightUnreadable:
    noun, source = _EXPECTED[kinds]
    reason = str(error) or type(error).__name__
    return FlightUnreadable(f"{path}: no whole {noun}: {reason}; expected an MCAP file of {source}")
