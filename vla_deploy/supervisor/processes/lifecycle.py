"""Decide, without doing anything, what each process of the table needs next."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from enum import Enum
from typing import Any

from drivers.clock import NS_PER_S
from vla_deploy.runtime.exit_codes import EXIT_CONFIGURATION, EXIT_DEVICE_ABSENT
from vla_deploy.supervisor.table import GivingUp, ProcessSpec, RestartPolicy

ABORT_GRACE_NS = NS_PER_S
"""How long a process that hangs may take to write its traceback before it is killed."""


class ProcessState(Enum):
    """Name where a process stands."""

    OFF = "off"
    WAITING = "waiting"
    STARTING = "starting"
    READY = "ready"
    ABORTING = "aborting"
    BACKOFF = "back-off"
    GIVEN_UP = "given up"
    STOPPING = "stopping"
    STOPPED = "stopped"


SETTLED = frozenset({ProcessState.READY, ProcessState.OFF})
TROUBLED = frozenset({ProcessState.ABORTING, ProcessState.BACKOFF, ProcessState.GIVEN_UP})


def is_settled(table: Mapping[str, Any]) -> bool:
    """Return whether a published process table shows every process ready that should run."""
    states = [ProcessState(row["state"]) for row in table["processes"]]
    return bool(states) and SETTLED.issuperset(states)


class ProcessAct(Enum):
    """Name what is done to a process; ABORT ends it with a traceback of where it hangs."""

    SPAWN = "spawn"
    TERMINATE = "terminate"
    ABORT = "abort"
    KILL = "kill"


@dataclass(frozen=True, slots=True, kw_only=True)
class ProcessRecord:
    """Record one process; `until_ns` ends its back-off, its start, its abortion or its stop.

    `failures` counts since it last ran stably; `failed_ns` are the last failures' times, stable
    runs or not.
    """

    state: ProcessState = ProcessState.WAITING
    until_ns: int = 0
    ready_ns: int = 0
    was_ready: bool = False
    failures: int = 0
    failed_ns: tuple[int, ...] = ()
    restarts: int = 0
    exit_code: int | None = None
    reason: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class ProcessSeen:
    """Report what was observed of one process; `exit_code` is None while it runs.

    `silence` names the topic it has not written for longer than the table allows, `refused` is why
    the computer could not start it.
    """

    exit_code: int | None = None
    ready: bool = False
    silence: str = ""
    refused: str = ""

    @property
    def ended(self) -> bool:
        """Return whether nothing runs."""
        return self.exit_code is not None or bool(self.refused)


Step = tuple[ProcessRecord, ProcessAct | None]
Action = tuple[ProcessAct, str]
RUNNING = frozenset(
    {ProcessState.STARTING, ProcessState.READY, ProcessState.ABORTING, ProcessState.STOPPING}
)


def reconcile(
    table: Sequence[ProcessSpec],
    records: Mapping[str, ProcessRecord],
    seen: Mapping[str, ProcessSeen],
    *,
    unwanted: Mapping[str, str],
    now_ns: int,
) -> tuple[dict[str, ProcessRecord], tuple[Action, ...]]:
    """Return the new records and what is to be done, in order.

    `unwanted` maps each process that must not run to the reason; the last in the table stops first.
    """
    stopped, stops = _end(table, records, seen, unwanted, ProcessState.OFF, now_ns)
    after = dict(stopped)
    actions = list(stops)
    may_go = all_before_work = True
    for spec in table:
        may_go = may_go if spec.with_previous else all_before_work
        if spec.name in unwanted:
            continue
        record, act = _run_step(
            spec, after[spec.name], seen.get(spec.name, ProcessSeen()), may_go=may_go, now_ns=now_ns
        )
        after[spec.name] = record
        if act is not None:
            actions.append((act, spec.name))
        all_before_work &= _permits_next(spec, record)
    return after, tuple(actions)


def wind_down(
    table: Sequence[ProcessSpec],
    records: Mapping[str, ProcessRecord],
    seen: Mapping[str, ProcessSeen],
    *,
    now_ns: int,
) -> tuple[dict[str, ProcessRecord], tuple[Action, ...]]:
    """Return the new records and what is to be done to stop everything, the last first."""
    everyone = dict.fromkeys(records, "")
    return _end(table, records, seen, everyone, ProcessState.STOPPED, now_ns)


def _end(
    table: Sequence[ProcessSpec],
    records: Mapping[str, ProcessRecord],
    seen: Mapping[str, ProcessSeen],
    unwanted: Mapping[str, str],
    end: ProcessState,
    now_ns: int,
) -> tuple[dict[str, ProcessRecord], tuple[Action, ...]]:
    after = dict(records)
    actions: list[Action] = []
    may_go = all_after_ended = True
    for spec in reversed(table):
        if spec.name in unwanted:
            record, act = _stop_step(
                spec,
                after[spec.name],
                seen.get(spec.name, ProcessSeen()),
                may_go=may_go,
                now_ns=now_ns,
            )
            gone_for_good = record.state is ProcessState.GIVEN_UP and end is ProcessState.OFF
            if record.state not in RUNNING and not gone_for_good:
                record = replace(record, state=end, reason=unwanted[spec.name] or record.reason)
            after[spec.name] = record
            if act is not None:
                actions.append((act, spec.name))
            all_after_ended &= record.state not in RUNNING
        may_go = may_go if spec.with_previous else all_after_ended
    return after, tuple(actions)


def _permits_next(spec: ProcessSpec, record: ProcessRecord) -> bool:
    """Return whether the rows after it may start: it is ready, or given up and dispensable."""
    dispensable = record.was_ready or spec.giving_up is GivingUp.CARRY_ON
    return record.state is ProcessState.READY or (
        record.state is ProcessState.GIVEN_UP and dispensable
    )


def _run_step(
    spec: ProcessSpec, record: ProcessRecord, seen: ProcessSeen, *, may_go: bool, now_ns: int
) -> Step:
    if record.state is ProcessState.STOPPING:  # wanted again: it ends, then starts
        return _stop_step(spec, record, seen, may_go=True, now_ns=now_ns)
    if record.state in RUNNING:
        return _watch(spec, record, seen, now_ns)
    if not may_go or record.state is ProcessState.GIVEN_UP or now_ns < record.until_ns:
        return record, None
    started = replace(
        record,
        state=ProcessState.STARTING,
        until_ns=now_ns + round(spec.ready_timeout_s * NS_PER_S),
        restarts=record.restarts + (record.state is ProcessState.BACKOFF),
        reason=record.reason if record.state is ProcessState.BACKOFF else "",
    )
    return started, ProcessAct.SPAWN


def _watch(spec: ProcessSpec, record: ProcessRecord, seen: ProcessSeen, now_ns: int) -> Step:
    if seen.ended:
        return _failed(spec, record, seen, now_ns), None
    if record.state is ProcessState.ABORTING:
        return record, ProcessAct.KILL if now_ns >= record.until_ns else None
    if record.state is ProcessState.READY:
        return _watch_ready(spec, record, seen, now_ns)
    if seen.ready:
        ready = replace(
            record, state=ProcessState.READY, ready_ns=now_ns, was_ready=True, reason=""
        )
        return ready, None
    if now_ns >= record.until_ns:
        return abort(record, f"not ready within {spec.ready_timeout_s:g} s", now_ns)
    return record, None


def _watch_ready(spec: ProcessSpec, record: ProcessRecord, seen: ProcessSeen, now_ns: int) -> Step:
    if seen.silence:
        return abort(record, seen.silence, now_ns)
    if record.failures and now_ns - record.ready_ns >= spec.restart.stable_s * NS_PER_S:
        return replace(record, failures=0), None
    return record, None


def abort(record: ProcessRecord, reason: str, now_ns: int) -> Step:
    """End a running process for a reason; it is started again like one that has failed."""
    until_ns = now_ns + ABORT_GRACE_NS
    return replace(
        record, state=ProcessState.ABORTING, until_ns=until_ns, reason=reason
    ), ProcessAct.ABORT


def _failed(
    spec: ProcessSpec, record: ProcessRecord, seen: ProcessSeen, now_ns: int
) -> ProcessRecord:
    policy, failures = spec.restart, record.failures + 1
    why = record.reason if record.state is ProcessState.ABORTING else _end_in_words(seen)
    failed_ns = (*record.failed_ns, now_ns)[-policy.most_in_window - 1 :]
    failed = replace(
        record, failures=failures, failed_ns=failed_ns, exit_code=seen.exit_code, reason=why
    )
    # A wrong file stays wrong: trying again cannot help what never worked.
    if seen.exit_code == EXIT_CONFIGURATION and not record.was_ready:
        return replace(failed, state=ProcessState.GIVEN_UP)
    if failures > policy.max_restarts:
        why = f"{why}; given up after {failures} failures, never {policy.stable_s:g} s in order"
        return replace(failed, state=ProcessState.GIVEN_UP, reason=why)
    spanned_ns = now_ns - failed_ns[0]
    if len(failed_ns) > policy.most_in_window and spanned_ns <= policy.window_s * NS_PER_S:
        why = f"{why}; given up after {len(failed_ns)} failures in {spanned_ns / NS_PER_S:.0f} s"
        return replace(failed, state=ProcessState.GIVEN_UP, reason=why)
    until_ns = now_ns + round(delay_s(policy, failures) * NS_PER_S)
    return replace(failed, state=ProcessState.BACKOFF, until_ns=until_ns)


def delay_s(policy: RestartPolicy, failures: int) -> float:
    """Return how long a process that has failed so often in a row waits for its next start."""
    return min(policy.initial_s * policy.factor ** (failures - 1), policy.cap_s)


def _end_in_words(seen: ProcessSeen) -> str:
    if seen.exit_code is None:
        return f"could not be started: {seen.refused}"
    return describe_exit(seen.exit_code)


def _stop_step(
    spec: ProcessSpec, record: ProcessRecord, seen: ProcessSeen, *, may_go: bool, now_ns: int
) -> Step:
    if record.state not in RUNNING:
        return record, None
    if seen.ended:
        ended = replace(
            record, state=ProcessState.WAITING, exit_code=seen.exit_code, until_ns=now_ns
        )
        return ended, None
    if record.state is ProcessState.STOPPING:
        return record, ProcessAct.KILL if now_ns >= record.until_ns else None
    if not may_go:
        return record, None
    until_ns = now_ns + round(spec.stop_timeout_s * NS_PER_S)
    return replace(record, state=ProcessState.STOPPING, until_ns=until_ns), ProcessAct.TERMINATE


def describe_exit(exit_code: int) -> str:
    """Return in words how a process ended; a negative code is the signal that killed it."""
    if exit_code == EXIT_DEVICE_ABSENT:
        return f"a device is absent: exit code {exit_code}"
    return f"killed by signal {-exit_code}" if exit_code < 0 else f"exit code {exit_code}"
