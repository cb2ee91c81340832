"""Publish the process table: for `status`, for control, which watches it, and for the demo."""

import os
from collections.abc import Mapping

from drivers.clock import Clock
from vla_deploy.ipc import SharedSpace, topics
from vla_deploy.ipc.payloads.supervision import ProcessRow, UsageDocument, WatchedTopic
from vla_deploy.supervisor.budgets.sampler import UsageSnapshot
from vla_deploy.supervisor.processes.lifecycle import ProcessRecord
from vla_deploy.supervisor.processes.liveness import Vital
from vla_deploy.supervisor.processes.process_manager import ProcessManager
from vla_deploy.supervisor.runs.options import RunOptions

_SUPERVISOR = "supervisor"
_UNKNOWN_USAGE: UsageDocument = {
    "memory_mb": None,
    "rss_mb": None,
    "cpu_ratio": None,
    "cpu_s": None,
}


class ProcessTableWriter:
    """Write the `process_table` cell."""

    def __init__(self, run_id: str, options: RunOptions, space: SharedSpace, clock: Clock) -> None:
        self._cell = space.cell_writer(topics.PROCESS_TABLE)
        self._run_id = run_id
        self._options = options

    def publish(
        self,
        records: Mapping[str, ProcessRecord],
        processes: ProcessManager,
        vitals: Mapping[str, tuple[Vital, ...]],
        refusal: str,
        snapshot: UsageSnapshot | None,
    ) -> None:
        """Publish the table with what was measured; `refusal` is why no command is taken."""
        pids = processes.pids()
        usages = {} if snapshot is None else _usages(snapshot)
        rows = [
            _row(
                name,
                record,
                pids,
                processes,
                vitals.get(name, ()),
                usages.get(name, _UNKNOWN_USAGE),
            )
            for name, record in records.items()
        ]
        self._cell.put_document(
            {
                "run_id": self._run_id,
                "robot": self._options.robot,
                "profile": processes.profile,
                "twin": self._options.twin,
                "supervisor_pid": os.getpid(),
                "refusal": refusal,
                "processes": rows,
                "supervisor": usages.get(_SUPERVISOR, _UNKNOWN_USAGE),
                "peak_memory_mb": None if snapshot is None else round(snapshot.peak_memory_mb, 1),
                "memory_kind": None if snapshot is None else snapshot.memory_kind,
            }
        )


def _usages(snapshot: UsageSnapshot) -> dict[str, UsageDocument]:
    return {
        name: {
            "memory_mb": round(usage.memory_mb, 1),
            "rss_mb": round(usage.rss_mb, 1),
            "cpu_ratio": round(usage.cpu_ratio, 3),
            "cpu_s": round(usage.cpu_s, 2),
        }
        for name, usage in snapshot.usages.items()
    }


def _row(
    name: str,
    record: ProcessRecord,
    pids: Mapping[str, int],
    processes: ProcessManager,
    vitals: tuple[Vital, ...],
    usage: UsageDocument,
) -> ProcessRow:
    return {
        "name": name,
        "state": record.state.value,
        "pid": pids.get(name),
        "fresh": name in pids and processes.is_fresh(name),
        "restarts": record.restarts,
        "exit_code": record.exit_code,
        "reason": record.reason,
        "topics": [_topic(vital) for vital in vitals],
        "alarms": [alarm for vital in vitals for alarm in vital.alarms],
        **usage,
    }


def _topic(vital: Vital) -> WatchedTopic:
    return {
        "topic": vital.topic,
        "age_s": round(vital.age_s, 3),
        "rate_hz": None if vital.rate_hz is None else round(vital.rate_hz, 1),
        "least_hz": round(vital.least_hz, 1),
        "faults": list(vital.faults),
    }
