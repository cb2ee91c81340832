"""Look at all topics at one moment, without holding up who writes them."""

from collections import deque
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from drivers.clock import NS_PER_S, Clock
from vla_deploy.ipc import TOPICS, CellReader, PulseReader, Sample, SharedSpace
from vla_deploy.navigation.localising.place_judge import PlaceState
from vla_deploy.telemetry.metrics.flow import OWN, PULSES

WINDOW_NS: Final = 5 * NS_PER_S
SILENT_S: Final = 3.0
"""A topic counts as silent when it is older than this and than twice its deadline."""

_DEADLINES_S: Final = {topic.name: topic.deadline_s for topic in TOPICS}
_HEAD: Final = ("robot", "profile", "twin")
Document = Mapping[str, Any]


@dataclass(frozen=True, slots=True, kw_only=True)
class Told:
    """Carry what a topic tells; without a document `reason` says why."""

    document: Document | None
    reason: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Look:
    """Carry what every topic told at one moment, by its name, and `PULSES` and `OWN` beside."""

    now_ns: int
    told: Mapping[str, Told]


class Looker:
    """Follow the topics of one run."""

    def __init__(
        self,
        space: SharedSpace,
        clock: Clock,
        topics: Iterable[str],
        joint_names: Callable[[str], tuple[str, ...]],
    ) -> None:
        """Open the topics; `joint_names` gives the joints of a robot by its name."""
        self._clock = clock
        self._cells = {name: space.cell_reader(name) for name in topics}
        self._pulses = {topic.name: _Beat(space.pulse_reader(topic.name)) for topic in TOPICS}
        self._joint_names = joint_names
        self._robot = ""
        self._names: tuple[str, ...] = ()

    def look(self, own: Document) -> Look:
        """Return what the topics tell now; `own` is what whoever looks tells of itself."""
        now_ns = self._clock.now_ns()
        told = {name: self._told(name, cell, now_ns) for name, cell in self._cells.items()}
        self._know_robot(told)
        for prepare in _PREPARED:
            if prepare in told:
                told[prepare] = _prepared(told[prepare], _PREPARED[prepare], self._names)
        pulses = {name: beat.document(name, now_ns) for name, beat in self._pulses.items()}
        told[PULSES] = Told(document={name: one for name, one in pulses.items() if one})
        told[OWN] = Told(document=own)
        return Look(now_ns=now_ns, told=told)

    def _told(self, name: str, cell: CellReader, now_ns: int) -> Told:
        sample = cell.latest()
        if sample is None:
            return Told(document=None, reason=f"nobody has written {name} yet")
        age_s = sample.age_s(now_ns)
        if _DEADLINES_S[name] and age_s > max(SILENT_S, 2 * _DEADLINES_S[name]):
            return Told(document=None, reason=f"{name} has been silent for {age_s:.1f} s")
        return Told(document=_document(sample))

    def _know_robot(self, told: Mapping[str, Told]) -> None:
        table = told["process_table"].document if "process_table" in told else None
        if table is not None and table["robot"] != self._robot:
            self._robot = table["robot"]
            self._names = self._joint_names(self._robot)


class _Beat:
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
        while len(self._seen) > 2 and now_ns - self._seen[1][0] >= WINDOW_NS:
            self._seen.popleft()
        told: dict[str, float] = {"messages": pulse.sequence}
        first_ns, first = self._seen[0]
        if now_ns > first_ns:
            told["rate_hz"] = (pulse.sequence - first) * NS_PER_S / (now_ns - first_ns)
        if _DEADLINES_S[name]:
            told |= {"age_s": pulse.age_s(now_ns), "deadline_s": _DEADLINES_S[name]}
        return told


def _document(sample: Sample) -> Document:
    if sample.dtype is None:
        return sample.document()
    record = sample.data
    return {name: np.asarray(record[name]).tolist() for name in sample.dtype.names or ()}


def _with_names(document: Document, names: tuple[str, ...]) -> Document:
    return {**document, "joint_names": names}


def _with_head(document: Document, _: tuple[str, ...]) -> Document:
    return {**document, "head": {key: str(document[key]).lower() for key in _HEAD}}


def _with_state(document: Document, _: tuple[str, ...]) -> Document:
    return {**document, "state": PlaceState(document["state"]).name.lower()}


def _with_joints(document: Document, names: tuple[str, ...]) -> Document:
    return {**document, "joints": {**document.get("joints", {}), "joint_names": names}}


_PREPARED: Final[Mapping[str, Callable[[Document, tuple[str, ...]], Document]]] = {
    "joint_state": _with_names,
    "control_status": _with_joints,
    "process_table": _with_head,
    "pose": _with_state,
}


def _prepared(
    told: Told,
    prepare: Callable[[Document, tuple[str, ...]], Document],
    names: tuple[str, ...],
) -> Told:
    return told if told.document is None else Told(document=prepare(told.document, names))
