"""Decide, without doing anything, what each process of the table needs next."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from enum import Enum

from drivers.clock import NS_PER_S
from vla_deploy.exit_codes import EXIT_CONFIGURATION
from vla_deploy.supervisor.table import ProcessSpec


class State(Enum):
    """Name where a process stands."""

    WAITING = "waiting"
    STARTING = "starting"
    READY = "ready"
    BACKOFF = "back-off"
    GIVEN_UP = "given up"
    STOPPING = "stopping"
    STOPPED = "stopped"


class Act(Enum):
    """Name what is to be done to a process."""

    SPAWN = "spawn"
    TERMINATE = "terminate"
    KILL = "kill"


@dataclass(frozen=True, slots=True, kw_only=True)
class Record:
    """Remember one process; `until_ns` ends its back-off, its start or its stop."""

    state: State = State.WAITING
    until_ns: int = 0
    was_ready: bool = False
    failures_ns: tuple[int, ...] = ()
    restarts: int = 0
    exit_code: int | None = None
    reason: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Seen:
    """Report what was observed of one process; `exit_code` is None while it runs.

    `silent` tells that it has told nothing for longer than the table allows.
    """

    exit_code: int | None = None
    ready: bool = False
    silent: bool = False


Step = tuple[Record, Act | None]
Action = tuple[Act, str]
_ALIVE = frozenset({State.STARTING, State.READY, State.STOPPING})


def reconcile(
    table: Sequence[ProcessSpec],
    records: Mapping[str, Record],
    seen: Mapping[str, Seen],
    *,
    stopping: bool,
    now_ns: int,
) -> tuple[dict[str, Record], tuple[Action, ...]]:
    """Return the new records and what is to be done, in order."""
    after = dict(records)
    actions: list[Action] = []
    decide, order = (_stop_step, reversed(table)) if stopping else (_run_step, iter(table))
    may_go = True
    for spec in order:
        record, act = decide(
            spec, after[spec.name], seen.get(spec.name, Seen()), may_go=may_go, now_ns=now_ns
        )
        after[spec.name] = record
        if act is not None:
            actions.append((act, spec.name))
        may_go &= record.state is State.STOPPED if stopping else _lets_others_go(record)
    return after, tuple(actions)


def _lets_others_go(record: Record) -> bool:
    """Tell whether those after it may start: not when it never worked at all."""
    return record.state is State.READY or (record.state is State.GIVEN_UP and record.was_ready)


def _run_step(spec: ProcessSpec, record: Record, seen: Seen, *, may_go: bool, now_ns: int) -> Step:
    if record.state in _ALIVE:
        return _watch(spec, record, seen, now_ns)
    if not may_go or record.state is State.GIVEN_UP or now_ns < record.until_ns:
        return record, None
    started = replace(
        record,
        state=State.STARTING,
        until_ns=now_ns + round(spec.ready_timeout_s * NS_PER_S),
        restarts=record.restarts + (record.state is State.BACKOFF),
    )
    return started, Act.SPAWN


def _watch(spec: ProcessSpec, record: Record, seen: Seen, now_ns: int) -> Step:
    if seen.exit_code is not None:
        return _failed(spec, record, seen.exit_code, now_ns), None
    if record.state is State.READY and seen.silent:
        reason = f"silent for more than {spec.silence_limit_s:g} s"
        return replace(record, reason=reason), Act.KILL
    if record.state is not State.STARTING:
        return record, None
    if seen.ready:
        return replace(record, state=State.READY, was_ready=True, reason=""), None
    if now_ns >= record.until_ns:
        reason = f"not ready within {spec.ready_timeout_s:g} s"
        return replace(record, reason=reason), Act.KILL
    return record, None


def _failed(spec: ProcessSpec, record: Record, exit_code: int, now_ns: int) -> Record:
    policy = spec.restart
    window_ns = round(policy.window_s * NS_PER_S)
    recent = (*(at for at in record.failures_ns if now_ns - at < window_ns), now_ns)
    overdue = record.state is State.STARTING and now_ns >= record.until_ns
    was_killed = bool(record.reason) and (overdue or record.state is State.READY)
    why = record.reason if was_killed else describe_exit(exit_code)
    failed = replace(record, failures_ns=recent, exit_code=exit_code, reason=why)
    # What the file or the wiring says will not change by trying again before it ever worked.
    if exit_code == EXIT_CONFIGURATION and not record.was_ready:
        return replace(failed, state=State.GIVEN_UP)
    if len(recent) > policy.max_restarts:
        why = f"{why}; given up after {len(recent)} failures in {policy.window_s:g} s"
        return replace(failed, state=State.GIVEN_UP, reason=why)
    delay_s = min(policy.initial_s * policy.factor ** (len(recent) - 1), policy.cap_s)
    return replace(failed, state=State.BACKOFF, until_ns=now_ns + round(delay_s * NS_PER_S))


def _stop_step(spec: ProcessSpec, record: Record, seen: Seen, *, may_go: bool, now_ns: int) -> Step:
    if record.state not in _ALIVE:
        return replace(record, state=State.STOPPED), None
    if seen.exit_code is not None:
        return replace(record, state=State.STOPPED, exit_code=seen.exit_code), None
    if record.state is State.STOPPING:
        return record, Act.KILL if now_ns >= record.until_ns else None
    if not may_go:
        return record, None
    until_ns = now_ns + round(spec.stop_timeout_s * NS_PER_S)
    return replace(record, state=State.STOPPING, until_ns=until_ns), Act.TERMINATE


def describe_exit(exit_code: int) -> str:
    """Say in words how a process ended; a negative code is the signal that killed it."""
    return f"killed by signal {-exit_code}" if exit_code < 0 else f"exit code {exit_code}"
