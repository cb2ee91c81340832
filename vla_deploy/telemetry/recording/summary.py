"""Tell what a recording or a flight holds, from its index alone."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from mcap.reader import McapReader, make_reader

from drivers.clock import NS_PER_S
from vla_deploy.telemetry.errors import FlightUnreadable
from vla_deploy.telemetry.mcap_file import SPOILED

KINDS = ("recording", "flight")


@dataclass(frozen=True, slots=True, kw_only=True)
class Summary:
    """Describe one file; times are wall clock, `counts` is the number of messages per channel."""

    path: Path
    kind: str
    run_id: str
    robot: str
    profile: str
    version: str
    wall_offset_ns: int
    began_ns: int
    ended_ns: int
    counts: Mapping[str, int]
    causes: tuple[str, ...] = ()

    @property
    def duration_s(self) -> float:
        """Return how long it goes on."""
        return (self.ended_ns - self.began_ns) / NS_PER_S

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
            "causes": list(self.causes),
        }


def summary_of(path: Path) -> Summary:
    """Read what a file says of itself.

    Raises:
        FlightUnreadable: it cannot be opened, is cut off, spoiled, or not recorded by us.
    """
    try:
        with path.open("rb") as file:
            return _summary(path, make_reader(file))
    except OSError as error:
        raise FlightUnreadable(f"{path}: {error.strerror}") from error
    except SPOILED as error:
        reason = str(error) or type(error).__name__
        raise FlightUnreadable(
            f"{path}: no whole recording: {reason}; expected an MCAP file of this project, see: "
            "vla-deploy record list, vla-deploy flight list"
        ) from error


def _summary(path: Path, reader: McapReader) -> Summary:
    metadata = {record.name: record.metadata for record in reader.iter_metadata()}
    kind = next((name for name in KINDS if name in metadata), None)
    found = reader.get_summary()
    if kind is None or found is None or found.statistics is None:
        raise ValueError("it has no index, or not what our recordings say of themselves")
    head, statistics = metadata[kind], found.statistics
    causes = json.loads(head.get("causes", "[]"))
    return Summary(
        path=path,
        kind=kind,
        run_id=head["run_id"],
        robot=head["robot"],
        profile=head["profile"],
        version=head["vla_deploy"],
        wall_offset_ns=int(head["wall_offset_ns"]),
        began_ns=statistics.message_start_time,
        ended_ns=statistics.message_end_time,
        counts={
            found.channels[channel].topic: count
            for channel, count in statistics.channel_message_counts.items()
        },
        causes=tuple(str(cause["what"]) for cause in causes),
    )
