"""Keep what telemetry tells of a servo bus: cycle times, error budgets, decisions about faults."""

from collections import deque
from collections.abc import Sequence
from typing import Any, Final

import numpy as np

from drivers.error_budget import BusBudget
from drivers.latency import LatencyHistogram
from drivers.servo.fault_policy import FaultDecision, FaultPolicy
from drivers.servo.joint_servo import JointServo
from drivers.servo.state import BusState

_MOST_TIMES: Final = 4096
_MOST_DECISIONS: Final = 32


class BusJournal:
    """Take note of every cycle; a good one costs an append."""

    def __init__(
        self,
        servos: Sequence[JointServo],
        state: BusState,
        policy: FaultPolicy,
    ) -> None:
        self.latency = LatencyHistogram()
        """How long the answers of the cycles' block reads took."""
        self.budget = BusBudget([servo.joint for servo in servos])
        """A cycle that gave no value of a servo is a failure of that servo."""
        self._servos = servos
        self._state = state
        self._policy = policy
        self._decisions: deque[FaultDecision] = deque(maxlen=_MOST_DECISIONS)
        self._seen_errors = bytes(len(servos))
        self.answer_times_ns: deque[int] = deque(maxlen=_MOST_TIMES)
        """From request to whole answer, of each cycle since telemetry was last asked for."""

    def note_gaps(self) -> None:
        """Charge the servos that gave no value in this cycle to their budgets."""
        failed = np.flatnonzero(~self._state.valid).tolist()
        self.budget.note_cycle(failed, self._state.stamp_ns)

    def note_errors(self) -> None:
        """Decide about hardware errors that are new since the last call."""
        errors = self._state.error.tobytes()
        if errors == self._seen_errors:
            return
        for servo, bits, seen in zip(self._servos, errors, self._seen_errors, strict=True):
            if bits != seen and (decision := self._policy.decide(servo.id, servo.joint, bits)):
                self._decisions.append(decision)
        self._seen_errors = errors

    @property
    def has_decisions(self) -> bool:
        """Return whether `take_decisions` has something."""
        return bool(self._decisions)

    def take_decisions(self) -> list[FaultDecision]:
        """Return the decisions made since this was called last."""
        decisions = list(self._decisions)
        self._decisions.clear()
        return decisions

    def as_dict(self) -> dict[str, Any]:
        """Return it all for telemetry."""
        while self.answer_times_ns:
            self.latency.record(self.answer_times_ns.popleft())
        self.budget.note_cycle((), self._state.stamp_ns)
        return {"latency": self.latency.as_dict(), "budget": self.budget.as_dict()}
