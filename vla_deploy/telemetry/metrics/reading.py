"""Read every metric of the table: take a snapshot of the topics, then follow each metric's paths.

The topics are shared memory: reading them delays none of the processes that write them.
"""

from collections import deque
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from drivers.clock import NS_PER_S, Clock
from vla_deploy.client.place_state import PlaceState
from vla_deploy.ipc import TOPICS, CellReader, PulseReader, Sample, SharedSpace
from vla_deploy.telemetry.metrics.metric import (
    MAX_SERIES,
    Histogram,
    Metric,
    MetricKind,
    MissingMetric,
    MissingReason,
    Point,
)
from vla_deploy.telemetry.metrics.paths import PathMatch, walk
from vla_deploy.telemetry.metrics.table import METRICS, OWN, PULSES

RATE_WINDOW_NS: Final = 5 * NS_PER_S
SILENT_S: Final = 3.0
"""A topic is silent when its value is older than this and than twice its deadline."""

_DEADLINES_S: Final = {topic.name: topic.deadline_s for topic in TOPICS}
Document = Mapping[str, Any]


@dataclass(frozen=True, slots=True, kw_only=True)
class TopicDocument:
    """Carry the document of a topic, or None and the reason why there is none."""

    document: Document | None
    reason: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class TopicSnapshot:
    """Carry the documents of all topics at one moment by name, with `PULSES` and `OWN`."""

    now_ns: int
    documents: Mapping[str, TopicDocument]


@dataclass(frozen=True, slots=True, kw_only=True)
class Readings:
    """Carry the points of each metric that has some, and why the others have none."""

    now_ns: int
    points: Mapping[str, tuple[Point, ...]]
    missing: tuple[MissingMetric, ...]
    left_out: int


class TopicSampler:
    """Take snapshots of the topics of one run."""

    def __init__(
        self,
        space: SharedSpace,
        clock: Clock,
        topics: Iterable[str],
        joint_names: Callable[[str], tuple[str, ...]],
    ) -> None:
        """Open the topics; `joint_names` returns the joints of a robot by its name."""
        self._clock = clock
        self._cells = {name: space.cell_reader(name) for name in topics}
        self._rates = {topic.name: _Rate(space.pulse_reader(topic.name)) for topic in TOPICS}
        self._joint_names = joint_names
        self._robot = ""
        self._names: tuple[str, ...] = ()

    def snapshot(self, own: Document) -> TopicSnapshot:
        """Return what the topics contain now; `own` is the caller's own document."""
        now_ns = self._clock.now_ns()
        found = {name: _latest(name, cell, now_ns) for name, cell in self._cells.items()}
        self._update_robot(found)
        documents = {
            name: one
            if one.document is None
            else TopicDocument(document=_extended(name, one.document, self._names))
            for name, one in found.items()
        }
        rates = {name: rate.document(name, now_ns) for name, rate in self._rates.items()}
        documents[PULSES] = TopicDocument(
            document={name: one for name, one in rates.items() if one}
        )
        documents[OWN] = TopicDocument(document=own)
        return TopicSnapshot(now_ns=now_ns, documents=documents)

    def _update_robot(self, found: Mapping[str, TopicDocument]) -> None:
        table = found["process_table"].document if "process_table" in found else None
        if table is not None and table["robot"] != self._robot:
            self._robot = table["robot"]
            self._names = self._joint_names(self._robot)


class _Rate:
    """Measure how often one topic is written."""

    def __init__(self, reader: PulseReader) -> None:
        self._reader = reader
        self._seen: deque[tuple[int, int]] = deque()

    def document(self, name: str, now_ns: int) -> dict[str, float]:
        """Return count, rate and age; nothing before the first value."""
        pulse = self._reader.latest()
        if pulse is None:
            return {}
        self._seen.append((now_ns, pulse.sequence))
        while len(self._seen) > 2 and now_ns - self._seen[1][0] >= RATE_WINDOW_NS:
            self._seen.popleft()
        measured: dict[str, float] = {"messages": pulse.sequence}
        first_ns, first = self._seen[0]
        if now_ns > first_ns:
            measured["rate_hz"] = (pulse.sequence - first) * NS_PER_S / (now_ns - first_ns)
        if _DEADLINES_S[name]:
            measured |= {"age_s": pulse.age_s(now_ns), "deadline_s": _DEADLINES_S[name]}
        return measured


def _latest(name: str, cell: CellReader[Any], now_ns: int) -> TopicDocument:
    sample = cell.latest()
    if sample is None:
        return TopicDocument(document=None, reason=f"nobody has written {name} yet")
    age_s = sample.age_s(now_ns)
    if _DEADLINES_S[name] and age_s > max(SILENT_S, 2 * _DEADLINES_S[name]):
        return TopicDocument(document=None, reason=f"{name} has been silent for {age_s:.1f} s")
    return TopicDocument(document=_document(sample))


def _document(sample: Sample[Any]) -> Document:
    if sample.dtype is None:
        document: Document = sample.document()
        return document
    record = sample.data
    return {name: np.asarray(record[name]).tolist() for name in sample.dtype.names or ()}


def _extended(topic: str, document: Document, joint_names: tuple[str, ...]) -> Document:
    """Return a document with what its metrics need beyond what the topic carries."""
    match topic:
        case "joint_state":
            return {**document, "joint_names": joint_names}
        case "control_status":
            joints = {**document.get("joints", {}), "joint_names": joint_names}
            return {**document, "joints": joints}
        case "process_table":
            head = {key: str(document[key]).lower() for key in ("robot", "profile", "twin")}
            return {**document, "head": head}
        case "pose":
            return {**document, "state": PlaceState(document["state"]).name.lower()}
        case _:
            return document


def read(snapshot: TopicSnapshot, metrics: Iterable[Metric] = METRICS) -> Readings:
    """Return every metric's points; a metric beyond `MAX_SERIES` loses its last ones."""
    points: dict[str, tuple[Point, ...]] = {}
    missing: list[MissingMetric] = []
    left_out = 0
    for metric in metrics:
        topic = snapshot.documents[metric.topic]
        found = [] if topic.document is None else _points(metric, topic.document)
        left_out += max(len(found) - MAX_SERIES, 0)
        if found:
            points[metric.name] = tuple(found[:MAX_SERIES])
        else:
            missing.append(_missing(metric, topic))
    return Readings(
        now_ns=snapshot.now_ns, points=points, missing=tuple(missing), left_out=left_out
    )


def _points(metric: Metric, document: Document) -> list[Point]:
    matches = [match for path in metric.paths for match in walk(path, document)]
    if metric.kind is MetricKind.STATES:
        return [
            Point(labels=(*match.labels, state), value=float(match.value == state))
            for match in matches
            for state in metric.states
        ]
    return [point for match in matches if (point := _point(metric, match)) is not None]


def _point(metric: Metric, match: PathMatch) -> Point | None:
    value = None if match.value is None else metric.take(match.value)
    if value is None:
        return None
    scaled = value if isinstance(value, Histogram) else value * metric.scale
    return Point(labels=match.labels, value=scaled)


def _missing(metric: Metric, topic: TopicDocument) -> MissingMetric:
    if topic.document is None:
        return MissingMetric(metric=metric.name, why=MissingReason.SILENT, text=topic.reason)
    # Readings of the computer come with the reasons why some of them cannot be had.
    reasons: Mapping[str, str] = topic.document.get("missing") or {}
    keys = (path[-1].key for path in metric.paths)
    known = next((reasons[key] for key in keys if key in reasons), "")
    if known:
        return MissingMetric(metric=metric.name, why=MissingReason.UNREADABLE, text=known)
    text = f"{metric.topic} does not tell it at present"
    return MissingMetric(metric=metric.name, why=MissingReason.NOT_REPORTED, text=text)
