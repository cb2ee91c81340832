"""Put together what `control_status` tells, when it is due."""

from typing import Any

from vla_deploy.control.judging.safety_stage import Judging
from vla_deploy.control.modes.modes import Modes
from vla_deploy.control.modes.operator_acts import OperatorInbox
from vla_deploy.control.modes.state_machine import status_name
from vla_deploy.control.modes.stop_proof import StopProof
from vla_deploy.control.motion.motions import MotionSet
from vla_deploy.control.output.base_drive import BaseDrive
from vla_deploy.control.output.servos import ServoLine
from vla_deploy.control.reporting.status_document import (
    bus_document,
    detail,
    joint_document,
    verdict_document,
)
from vla_deploy.control.reporting.status_pace import StatusPace
from vla_deploy.control.reporting.telemetry import TickClock
from vla_deploy.ipc.payloads.motion import ControlStatus


class Status:
    """Look at the parts of control that have something to tell."""

    def __init__(
        self,
        ticks: TickClock,
        modes: Modes,
        judging: Judging,
        inbox: OperatorInbox,
        motions: MotionSet,
        proof: StopProof,
        servos: ServoLine,
        wheels: BaseDrive,
        *,
        never_moves: str,
    ) -> None:
        self._ticks = ticks
        self._modes = modes
        self._judging = judging
        self._inbox = inbox
        self._motions = motions
        self._proof = proof
        self._servos = servos
        self._wheels = wheels
        self._never_moves = never_moves
        self._buses = (servos, wheels)
        self._pace = StatusPace()

    def due(self, every_ticks: int, now_ns: int) -> ControlStatus | None:
        """Return the document where this tick has to tell it."""
        if not self._pace.is_due(self._ticks.tick, self._matters(), every_ticks):
            return None
        return self._document(now_ns)

    def _matters(self) -> tuple[Any, ...]:
        """Return what of it nobody may learn late."""
        verdict, modes, inbox = self._judging.verdict, self._modes, self._inbox
        return (
            *(modes.mode, modes.notice, inbox.complaint, self._motions.active_ids),
            *(verdict.cause, verdict.reaction, verdict.latched, verdict.subject, verdict.blocked),
            *(self._judging.state.latched, self._proof.news),
        )

    def _document(self, now_ns: int) -> ControlStatus:
        verdict, ticks = self._judging.verdict, self._ticks
        return {
            "state": status_name(self._modes.mode, verdict.reaction),
            "estop_latched": self._judging.state.estop_latched,
            **verdict_document(verdict),
            "detail": detail(verdict.text, self._modes.notice, self._inbox.complaint),
            "never_moves": self._never_moves,
            "tick": ticks.tick,
            "judged_tick": self._judging.tick,
            "late_ticks": ticks.late_ticks,
            "period_s": round(ticks.period_s, 6),
            "nominal_period_s": ticks.nominal_s,
            "period_ratio": ticks.periods.document(),
            "buses": bus_document(*self._buses),
            "joints": joint_document(self._servos.state),
            "active_motions": self._motions.active_ids,
            "last_stop": self._proof.document(now_ns),
        }
