"""Run the flight recorder: keep all topics in memory, write them after a stop or a crash."""

import json
import logging
import math
import os
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from drivers.clock import NS_PER_S
from vla_deploy.ipc import CellWriter, RingWriter, SharedSpace, topics
from vla_deploy.ipc.payloads.recording import FlightEvent, RecorderStatus
from vla_deploy.runtime.node import NodeContext
from vla_deploy.telemetry.flight import write_flight
from vla_deploy.telemetry.folder import FlightFolder, dated
from vla_deploy.telemetry.recording.recorder import RollingRecorder
from vla_deploy.telemetry.topic_history import TopicHistory
from vla_deploy.telemetry.triggers import Debounce, FlightTrigger, TriggerDetector, TriggerKind

MESSAGES_AT_ONCE: Final = 150
_SHOWN_CAUSES = 20
_log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class _Writing:
    """Hold the flight that is being written."""

    part: Path
    causes: list[FlightTrigger]
    progress: Iterator[None]


class RecorderNode:
    """Keep the last half minute of every topic, and write it as a flight when triggered.

    A flight is written a few messages per step, so that no new values are missed meanwhile.
    """

    period_s = 0.04

    def __init__(
        self,
        context: NodeContext,
        folder: FlightFolder,
        wall_ns: Callable[[], int],
        debounce: Debounce | None = None,
        rolling: Callable[[SharedSpace], RollingRecorder] | None = None,
    ) -> None:
        self._context = context
        self._clock = context.clock
        self._space = SharedSpace(context.run_dir / "ipc", context.clock)
        self._folder = folder
        self._wall_ns = wall_ns
        self._detector = TriggerDetector()
        self._debounce = debounce or Debounce()
        self._writing: _Writing | None = None
        self._history: TopicHistory
        self._events: RingWriter[FlightEvent]
        self._status: CellWriter[RecorderStatus]
        self._status_due_ns = 0
        self._started_ns = 0
        self._parent_pid = os.getppid()
        self._rolling = None if rolling is None else rolling(self._space)

    def start(self) -> None:
        """Open every topic; what is still in the rings is read as well."""
        self._started_ns = self._clock.now_ns()
        self._history = TopicHistory(self._space)
        self._events = self._space.ring_writer(topics.FLIGHT_EVENT)
        self._status = self._space.cell_writer(topics.RECORDER_STATUS)
        if self._rolling is not None:
            self._rolling.start()

    def step(self) -> None:
        """Read what is new, look for triggers, and write some messages."""
        now_ns = self._clock.now_ns()
        self._detect(now_ns)
        if self._writing is None:
            self._begin(now_ns)
        else:
            self._continue(self._writing)
        self._report_status(now_ns)

    def stop(self) -> None:
        """Write what waits to be written, and close the topics.

        A killed supervisor is recognised by the changed parent of this process.
        """
        if os.getppid() != self._parent_pid:
            now_ns = self._clock.now_ns()
            self._notice(FlightTrigger(kind=TriggerKind.CRASH, what="supervisor", at_ns=now_ns))
        self._finish()
        self._begin(math.inf)
        self._finish()
        if self._rolling is not None:
            self._rolling.stop()
        self._space.close()

    # --- detect -------------------------------------------------------------------------------

    def _detect(self, now_ns: int) -> None:
        find: dict[str, Callable[[dict[str, Any], int], list[FlightTrigger]]] = {
            "control_status": self._detector.status,
            "process_table": self._detector.table,
            "flight_request": self._request,
        }
        new = self._history.refresh(now_ns)
        if self._rolling is not None:
            self._rolling.step(now_ns, new, self._history.newest)
        for channel, kept in new:
            if channel in find:
                for trigger in find[channel](json.loads(kept.payload), kept.stamp_ns):
                    self._notice(trigger)

    def _request(self, request: dict[str, Any], at_ns: int) -> list[FlightTrigger]:
        if at_ns < self._started_ns:
            return []
        reason = str(request.get("reason", ""))
        return [FlightTrigger(kind=TriggerKind.REQUEST, what="request", at_ns=at_ns, detail=reason)]

    def _notice(self, trigger: FlightTrigger) -> None:
        _log.info("%s: %s %s", trigger.kind.value, trigger.what, trigger.detail)
        self._debounce.add(trigger)

    # --- write --------------------------------------------------------------------------------

    def _begin(self, now_ns: float) -> None:
        """Begin a flight when one is due; `inf` takes all triggers that wait."""
        causes = self._debounce.take(now_ns)
        if not causes:
            return
        wall_ns, run_ns = self._wall_ns(), self._clock.now_ns()
        try:
            what = re.sub(r"[^a-z0-9_]+", "_", causes[0].what.lower())[:40]
            part = self._folder.unfinished(dated(wall_ns, what))
        except OSError as error:
            self._failed(causes, error)
            return
        values, ticks = self._history.snapshot(run_ns)
        progress = write_flight(
            part,
            self._context,
            causes,
            values,
            ticks,
            wall_offset_ns=wall_ns - run_ns,
            at_once=MESSAGES_AT_ONCE,
        )
        self._writing = _Writing(part, causes, progress)

    def _finish(self) -> None:
        while self._writing is not None:
            self._continue(self._writing)

    def _continue(self, writing: _Writing) -> None:
        try:
            for _ in writing.progress:
                return
            final = self._folder.publish(writing.part)
        except OSError as error:
            writing.part.unlink(missing_ok=True)
            self._failed(writing.causes, error)
        else:
            _log.info("saved %s", final)
            causes = _shown(writing.causes)
            self._events.publish({"event": "saved", "causes": causes, "file": str(final)})
        self._writing = None

    def _failed(self, causes: list[FlightTrigger], error: OSError) -> None:
        reason = f"{self._folder.path}: {error.strerror or error}"
        _log.error("no flight saved of %s: %s; make room on that disk", causes[0].what, reason)
        self._events.publish({"event": "failed", "causes": _shown(causes), "reason": reason})

    def _report_status(self, now_ns: int) -> None:
        if now_ns < self._status_due_ns:
            return
        self._status_due_ns = now_ns + NS_PER_S // 2
        self._status.put_document(
            {"writing": self._writing is not None, "held_bytes": self._history.held_bytes}
        )


def _shown(causes: list[FlightTrigger]) -> list[str]:
    return [cause.what for cause in causes[:_SHOWN_CAUSES]]
