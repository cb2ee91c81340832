"""Say in one line how the run is, for systemd and for people."""

from collections.abc import Mapping, Sequence

from vla_deploy.supervisor.processes.lifecycle import ProcessRecord, ProcessState

DEGRADED = "degraded"
LATE = "not in time"
_SETTLED = frozenset({ProcessState.READY, ProcessState.OFF})
_TROUBLE = frozenset({ProcessState.ABORTING, ProcessState.BACKOFF, ProcessState.GIVEN_UP})


def status_line(records: Mapping[str, ProcessRecord], *, stopping: bool, fault: str = "") -> str:
    """Return who is not ready, and why, or that all are; then what else a person should mend."""
    return _processes(records, stopping=stopping) + (fault and f"; {fault}")


def _processes(records: Mapping[str, ProcessRecord], *, stopping: bool) -> str:
    wanted = {
        name: record for name, record in records.items() if record.state is not ProcessState.OFF
    }
    if stopping:
        left = [name for name, record in wanted.items() if record.state is not ProcessState.STOPPED]
        return f"stopping: {', '.join(left) or 'nobody'} left"
    troubles = [
        f"{name} {record.state.value} ({record.reason})"
        for name, record in wanted.items()
        if record.state in _TROUBLE
    ]
    if troubles:
        return f"{DEGRADED}: {'; '.join(troubles)}"
    pending = [name for name, record in wanted.items() if record.state not in _SETTLED]
    if pending:
        return f"starting {pending[0]}: {len(wanted) - len(pending)} of {len(wanted)} ready"
    return f"all {len(wanted)} processes ready"


def with_late(status: str, troubles: Sequence[str]) -> str:
    """Add the first of what is not in time."""
    return f"{status}; {LATE}: {troubles[0]}" if troubles else status


def trouble_in(status: str) -> str:
    """Return a status that tells of a process that fails or is late; "" for one that does not."""
    return status if status.startswith(DEGRADED) or f"; {LATE}: " in status else ""
