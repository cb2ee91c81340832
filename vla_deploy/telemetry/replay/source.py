"""Read a recording or a flight from any moment on, and what was so at that moment."""

import os
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

from mcap.reader import make_reader

from vla_deploy.telemetry.errors import FlightUnreadable
from vla_deploy.telemetry.history import KEPT_NS
from vla_deploy.telemetry.mcap_file import SPOILED
from vla_deploy.telemetry.recording.summary import Summary, summary_of


@dataclass(frozen=True, slots=True, kw_only=True)
class Recorded:
    """Carry one message; `at_ns` is its place in the file, `stamp_ns` its stamp in the run's clock.

    `sequence` is the value's own, by which the parts of an image find each other.
    """

    channel: str
    at_ns: int
    stamp_ns: int
    sequence: int
    text: bytes


class Source:
    """Read one file.

    Raises:
        FlightUnreadable: it is no whole recording or flight.
    """

    def __init__(self, path: Path) -> None:
        self.summary: Summary = summary_of(path)
        """A flight's oldest values may be hours old: it begins where everything is remembered."""
        began_ns, self.ended_ns = self.summary.began_ns, self.summary.ended_ns
        is_flight = self.summary.kind == "flight"
        self.began_ns = max(began_ns, self.ended_ns - KEPT_NS) if is_flight else began_ns
        self._file = path.open("rb")
        self._path = path

    def from_moment(self, at_ns: int) -> Iterator[Recorded]:
        """Yield what was recorded at that moment and later, by time.

        Raises:
            FlightUnreadable: the file is spoiled.
        """
        yield from self._read(starting_at=at_ns)

    def before(self, at_ns: int, channels: Iterable[str]) -> Iterator[Recorded]:
        """Yield the last message of each channel before that moment.

        Raises:
            FlightUnreadable: the file is spoiled.
        """
        for channel in channels:
            if self.summary.counts.get(channel):
                yield from self._last(channel, at_ns)

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    def _last(self, channel: str, at_ns: int) -> Iterator[Recorded]:
        for one in self._read(topics=[channel], ending_before=at_ns, reverse=True):
            yield one
            return

    def _read(self, **choice: object) -> Iterator[Recorded]:
        # Each reading has its own place in the file: one may begin while another goes on.
        with os.fdopen(os.open(self._path, os.O_RDONLY), "rb") as file:
            try:
                reader = make_reader(file)
                for _, channel, message in reader.iter_messages(**choice):  # type: ignore[arg-type]
                    yield Recorded(
                        channel=channel.topic,
                        at_ns=message.log_time,
                        stamp_ns=message.publish_time - self.summary.wall_offset_ns,
                        sequence=message.sequence,
                        text=message.data,
                    )
            except SPOILED as error:
                raise FlightUnreadable(f"{self._path}: spoiled: {error}") from error
