"""Run the block read of each cycle and put its values, on the joint side, into the state."""

from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from drivers.clock import NS_PER_S
from drivers.dynamixel.block import BlockRead, Records, records_of
from drivers.dynamixel.codec import ALERT
from drivers.dynamixel.link import Link
from drivers.dynamixel.roster import Roster
from drivers.dynamixel.servo import ServoSpec
from drivers.dynamixel.state import BusState

_NEVER_NS: Final = -1
_Rows = NDArray[np.intp]


class StateReader:
    """Read the block of all polled servos; what one servo does costs the others nothing."""

    def __init__(
        self,
        link: Link,
        servos: Sequence[ServoSpec],
        roster: Roster,
        state: BusState,
        *,
        fast_sync: bool,
        margin_s: float,
    ) -> None:
        self._link = link
        self._servos = servos
        self._roster = roster
        self._state = state
        self._fast = fast_sync
        self._margin_s = margin_s
        self._per_pulse = np.array([servo.joint_per_pulse for servo in servos])
        self._at_pulse_zero = np.array([servo.to_joint(0) for servo in servos])
        self._per_velocity = np.array(
            [
                servo.model.velocity_unit_rad_s * servo.sign * servo.travel_per_rad
                for servo in servos
            ]
        )
        self._per_effort = np.array(
            [servo.model.effort_unit_ratio * servo.sign for servo in servos]
        )
        self._stamps_ns = np.full(len(servos), _NEVER_NS, dtype=np.int64)
        self._rows: _Rows | None = None
        self._all_fresh = False
        self.rebuild()

    def rebuild(self) -> None:
        """Prepare the request for the servos that are polled now."""
        polled = self._roster.polled
        ids = [self._servos[index].id for index in polled]
        self._block = BlockRead(ids, fast=self._fast)
        everyone = len(ids) == len(self._servos)
        self._rows = None if everyone else np.array(polled, dtype=np.intp)

    def read(self) -> None:
        """Run one block read and update the state's first group.

        Raises:
            LinkLost: the adapter is gone.
        """
        request = self._block.sync_read
        reply, deadline_ns = self._link.exchange(
            request.request, request.reply_bytes, self._margin_s
        )
        counters = self._link.counters
        counters.cycles += 1
        records = self._block.match(reply)
        if records is not None:
            self._roster.note_complete()
            if self._rows is None:
                self._store_all(records)
            else:
                self._store(records, self._rows)
            return
        records, indices = self._frame_anew(reply, deadline_ns)
        complete = len(indices) == len(self._roster.polled)
        counters.stuffed += complete
        counters.partial_cycles += not complete
        self._store(records, np.array(indices, dtype=np.intp))
        self._review_roster(indices)

    def note_silence(self) -> None:
        """Let all values grow old: the link is lost."""
        self._all_fresh = False
        self._state.valid[:] = False
        self._state.stamp_ns = self._link.now_ns()
        self._update_ages()

    def _frame_anew(self, reply: bytes, deadline_ns: int) -> tuple[Records, list[int]]:
        entries = self._link.collect(self._block.sync_read, reply, deadline_ns)
        indices = [index for index in self._roster.polled if self._servos[index].id in entries]
        ids = [self._servos[index].id for index in indices]
        return records_of(entries, ids), indices

    def _review_roster(self, answered: list[int]) -> None:
        if len(answered) == len(self._roster.polled):
            self._roster.note_complete()
        elif dropped := self._roster.note_partial(answered, chained=self._fast):
            self._link.counters.suspensions += len(dropped)
            self.rebuild()

    def _store_all(self, records: Records) -> None:
        """Do what `_store` does when all servos have answered, without scatter and temporaries."""
        state = self._state
        np.multiply(records["position"], self._per_pulse, out=state.position_rad)
        np.add(state.position_rad, self._at_pulse_zero, out=state.position_rad)
        np.multiply(records["velocity"], self._per_velocity, out=state.velocity_rad_s)
        np.multiply(records["effort"], self._per_effort, out=state.effort_ratio)
        np.greater_equal(records["error"], ALERT, out=state.alert)
        state.stamp_ns = self._link.now_ns()
        self._stamps_ns.fill(state.stamp_ns)
        if not self._all_fresh:
            self._all_fresh = True
            state.valid.fill(True)
            state.age_s.fill(0.0)

    def _store(self, records: Records, rows: _Rows) -> None:
        self._all_fresh = False
        state = self._state
        position = records["position"] * self._per_pulse[rows]
        state.position_rad[rows] = position + self._at_pulse_zero[rows]
        state.velocity_rad_s[rows] = records["velocity"] * self._per_velocity[rows]
        state.effort_ratio[rows] = records["effort"] * self._per_effort[rows]
        state.alert[rows] = records["error"] >= ALERT
        state.valid[:] = False
        state.valid[rows] = True
        state.stamp_ns = self._link.now_ns()
        self._stamps_ns[rows] = state.stamp_ns
        self._update_ages()

    def _update_ages(self) -> None:
        age_s = (self._state.stamp_ns - self._stamps_ns) / NS_PER_S
        self._state.age_s[:] = np.where(self._stamps_ns == _NEVER_NS, np.inf, age_s)
