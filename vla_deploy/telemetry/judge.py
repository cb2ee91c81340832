"""Judge recorded ticks again by the safety rules of this version, and compare the verdicts."""

from collections.abc import Iterable
from dataclasses import dataclass, fields
from functools import cache
from hashlib import sha256
from importlib.resources import files
from typing import Any

from vla_deploy.ipc import BadPayload
from vla_deploy.ipc.memory.delta import DeltaReader
from vla_deploy.ipc.memory.packing import Catalogue, types_within
from vla_deploy.safety import SafetyInputs, SafetyLimits, SafetyState, Verdict, evaluate
from vla_deploy.safety.causes import RULES
from vla_deploy.telemetry.errors import FlightForeign

JUDGED_TYPES = types_within(SafetyState, SafetyInputs, SafetyLimits, Verdict)
_CATALOGUE = Catalogue(JUDGED_TYPES)
_INPUT = "inputs."


@dataclass(frozen=True, slots=True, kw_only=True)
class RecordedTick:
    """Carry one tick as it was judged, and what was sent, if anything."""

    tick: int
    now_ns: int
    state: SafetyState
    inputs: SafetyInputs
    limits: SafetyLimits
    verdict: Verdict
    sent: Any


@dataclass(frozen=True, slots=True, kw_only=True)
class Difference:
    """Describe where this version judges otherwise than recorded."""

    tick: int
    field: str
    recorded: str
    judged: str


@dataclass(frozen=True, slots=True, kw_only=True)
class FlightJudgement:
    """Count the ticks judged again and those unreadable, with the first difference if any.

    Ticks before the first complete one, at most a second's worth, cannot be read.
    """

    ticks: int
    unread: int
    difference: Difference | None


@cache
def rules_digest() -> str:
    """Return a digest of the sources of the safety rules."""
    sources = {
        one.name: one.read_bytes()
        for one in files("vla_deploy.safety").iterdir()
        if one.name.endswith(".py")
    }
    return sha256(repr(sorted(sources.items())).encode()).hexdigest()


def judge_again(records: Iterable[bytes]) -> FlightJudgement:
    """Judge the ticks of one flight again, up to the first difference.

    Raises:
        FlightForeign: they were recorded by a version whose inputs or rules do not fit this one.
    """
    ticks = unread = 0
    before: tuple[int, SafetyState] | None = None
    reader = DeltaReader(JUDGED_TYPES)
    for record in records:
        tick = read_tick(reader, record)
        if tick is None:
            unread += 1
            continue
        ticks += 1
        if len(tick.state.counts) != len(RULES):
            raise FlightForeign(
                f"recorded by other rules: {len(tick.state.counts)} causes, this version has "
                f"{len(RULES)}; judge it with the version that recorded it"
            )
        state, verdict = evaluate(tick.state, tick.inputs, tick.limits)
        chained = before is not None and before[0] + 1 == tick.tick
        difference = _first_difference(tick.tick, tick.verdict, verdict) or (
            _first_difference(tick.tick, tick.state, before[1]) if chained and before else None
        )
        if difference is not None:
            return FlightJudgement(ticks=ticks, unread=unread, difference=difference)
        before = (tick.tick, state)
    return FlightJudgement(ticks=ticks, unread=unread, difference=None)


def read_tick(reader: DeltaReader, record: bytes) -> RecordedTick | None:
    """Return one tick, or None where a record before it is missing.

    Raises:
        FlightForeign: it was recorded by a version whose inputs do not fit this one.
    """
    try:
        row = reader.row(record)
        if row is None:
            return None
        given = {
            name.removeprefix(_INPUT): value
            for name, value in row.items()
            if name.startswith(_INPUT)
        }
        return RecordedTick(
            tick=row["tick"],
            now_ns=row["now_ns"],
            state=row["state"],
            inputs=SafetyInputs(**given),
            limits=row["limits"],
            verdict=row["verdict"],
            sent=row["sent"],
        )
    except (BadPayload, TypeError, KeyError) as error:
        raise FlightForeign(
            f"recorded by other rules, its ticks do not fit this version: {error}; judge it with "
            "the version that recorded it, or record an example flight anew"
        ) from error


def _first_difference(tick: int, recorded: Any, judged: Any) -> Difference | None:
    for field in fields(recorded):
        ours, theirs = getattr(judged, field.name), getattr(recorded, field.name)
        if _CATALOGUE.pack(ours) != _CATALOGUE.pack(theirs):
            name = f"{type(recorded).__name__}.{field.name}"
            return Difference(tick=tick, field=name, recorded=repr(theirs), judged=repr(ours))
    return None
