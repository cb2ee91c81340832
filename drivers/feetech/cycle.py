"""Run what a connected bus does in every cycle, and bring servos back that were away."""

from collections import deque
from collections.abc import Iterator, Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from drivers.clock import NS_PER_S
from drivers.errors import DriverError, LinkLost, NoReply, ProtocolError
from drivers.feetech.block import BLOCK_BYTES, FeetechBlock
from drivers.feetech.checks import EEPROM_BYTES
from drivers.feetech.goals import FeetechGoals
from drivers.feetech.link import FeetechLink, value_in
from drivers.feetech.servo import FeetechServo
from drivers.feetech.settings import FeetechSetup, write_kept_settings
from drivers.feetech.table import TorqueSwitch, hardware_errors
from drivers.servo.journal import BusJournal
from drivers.servo.patience import ReplyPatience
from drivers.servo.roster import Roster
from drivers.servo.state import SILENT_S, BusState

_NEVER_NS: Final = -1
_MOST_NOTICES: Final = 64
_PROBE_EVERY_TURNS: Final = 5


class FeetechCycle:
    """Read all servos, look after those that need it, and write goals.

    `notices` tell what was written to servos and which have come back, the newest last.
    """

    def __init__(
        self,
        link: FeetechLink,
        servos: Sequence[FeetechServo],
        setups: Sequence[FeetechSetup],
        state: BusState,
        journal: BusJournal,
        *,
        margin_s: float,
        health_every_cycles: int,
    ) -> None:
        """Work on servos that were set up as `setups` says."""
        self._link = link
        self._servos = servos
        self._setups = setups
        self._state = state
        self._journal = journal
        self._margin_s = margin_s
        self._patience = ReplyPatience(margin_s=margin_s, attempts=1)
        self._roster = Roster(len(servos))
        self._stamps_ns: NDArray[np.int64] = np.full(len(servos), _NEVER_NS, dtype=np.int64)
        self._all_fresh = False
        self._errors: tuple[Sequence[int], Sequence[int]] = ((), ())
        self._every_cycles = health_every_cycles
        self._count = self._turn = self._probes = 0
        self._returns: dict[int, Iterator[None]] = {}
        self._urgent: deque[int] = deque()
        joints = [servo for servo in servos if servo.wheel is None]
        self.goals = FeetechGoals(link, joints, setups[: len(joints)], margin_s=margin_s)
        self.notices: deque[str] = deque(maxlen=_MOST_NOTICES)
        for servo, setup in zip(servos, setups, strict=True):
            self.notices += [f"{servo}: set {text}" for text in setup.written]
        self._block = self._new_block()

    def read(self) -> None:
        """Read the block of all servos, and at most one servo's torque switch.

        Raises:
            LinkLost: the adapter is gone; all values go on growing old with each call.
        """
        try:
            self._read_block()
        except LinkLost:
            self._note_silence()
            raise
        self._look_after()

    def suspend(self, index: int) -> None:
        """Take a servo out of the block read; it rejoins when it answers again."""
        self._roster.suspend(index)
        self._block = self._new_block()

    @property
    def silent_rows(self) -> Sequence[int]:
        """Return the servos that have not answered for too long to be sent anywhere."""
        if self._all_fresh:
            return ()
        rows: list[int] = np.flatnonzero(self._state.age_s > SILENT_S).tolist()
        return rows

    def ask_torque(self, index: int) -> None:
        """Read in one of the next cycles whether a servo has torque."""
        if index not in self._urgent:
            self._urgent.append(index)

    def _new_block(self) -> FeetechBlock:
        return FeetechBlock(self._roster.polled, self._servos, self._state)

    def _read_block(self) -> None:
        link, block = self._link, self._block
        if block.in_one:
            reply, deadline_ns = link.exchange(block.request, block.reply_bytes, self._margin_s)
            if not block.take(reply):
                packets = link.collect(block.ids, BLOCK_BYTES, reply, deadline_ns)
                block.take_packets(packets)
        else:
            block.take_packets(block.read_singly(link, self._margin_s))
        self._finish()

    def _finish(self) -> None:
        state, block, link = self._state, self._block, self._link
        before_ns, state.stamp_ns = state.stamp_ns, link.now_ns()
        link.counters.cycles += 1
        self._journal.answer_times_ns.append(state.stamp_ns - link.last_sent_ns)
        if (block.answered, block.errors) != self._errors:
            self._note_errors()
        if len(block.answered) < len(self._servos):
            self._finish_partial(before_ns)
            return
        if not self._all_fresh:
            self._all_fresh = True
            state.valid.fill(True)
            state.age_s.fill(0.0)
            self._roster.note_complete()

    def _finish_partial(self, before_ns: int) -> None:
        state, block, counters = self._state, self._block, self._link.counters
        self._forget_freshness(before_ns)
        answered = list(block.answered)
        state.valid[:] = False
        state.valid[answered] = True
        self._stamps_ns[answered] = state.stamp_ns
        self._update_ages()
        self._journal.note_gaps()
        if len(answered) == len(block.members):
            self._roster.note_complete()
            return
        counters.partial_cycles += 1
        missing = [index for index in block.members if index not in answered]
        if answered and (dropped := self._roster.note_missing(missing)):
            counters.suspensions += len(dropped)
            self._block = self._new_block()

    def _note_errors(self) -> None:
        """Translate the error bytes; what they take away is read from the servo itself."""
        state, answered = self._state, list(self._block.answered)
        self._errors = (self._block.answered, self._block.errors)
        before = state.error[answered].copy()
        state.error[answered] = [hardware_errors(code) for code in self._block.errors]
        state.alert[answered] = state.error[answered] != 0
        for place in np.flatnonzero(before != state.error[answered]).tolist():
            self.ask_torque(answered[place])
        self._journal.note_errors()

    def _note_silence(self) -> None:
        self._forget_freshness(self._state.stamp_ns)
        self._state.valid[:] = False
        self._state.stamp_ns = self._link.now_ns()
        self._update_ages()

    def _forget_freshness(self, since_ns: int) -> None:
        if self._all_fresh:
            self._stamps_ns.fill(since_ns)
        self._all_fresh = False

    def _update_ages(self) -> None:
        age_s = (self._state.stamp_ns - self._stamps_ns) / NS_PER_S
        self._state.age_s[:] = np.where(self._stamps_ns == _NEVER_NS, np.inf, age_s)

    # --- one transaction beside the block ------------------------------------------------------

    def _look_after(self) -> None:
        if self._urgent:
            self._read_torque(self._urgent.popleft())
            return
        if self._returns:
            self._go_on_with_return()
            return
        self._count += 1
        if self._count % self._every_cycles:
            return
        self._turn += 1
        away, polled = self._roster.suspended, self._roster.polled
        if away and (len(away) > len(polled) or self._turn % _PROBE_EVERY_TURNS == 0):
            self._probes += 1
            self._returns[away[self._probes % len(away)]] = self._bring_back(
                away[self._probes % len(away)]
            )
            self._go_on_with_return()
            return
        # Probes take turns away, so places are counted apart: none may fall on the same turns.
        self._read_torque(polled[(self._turn - self._probes) % len(polled)])

    def _read_torque(self, index: int) -> None:
        try:
            value = self._link.read(self._servos[index], "torque_enable", self._patience)
        except (NoReply, ProtocolError):  # counted by the link; the next turn asks again
            return
        self._state.torque_on[index] = value == TorqueSwitch.ON

    def _go_on_with_return(self) -> None:
        """Make one more transaction with a servo that was away."""
        index, steps = next(iter(self._returns.items()))
        try:
            next(steps)
        except StopIteration:
            del self._returns[index]
        except LinkLost:
            raise
        except DriverError:  # counted by the link; the next probe begins anew
            del self._returns[index]

    def _bring_back(self, index: int) -> Iterator[None]:
        """Set up a servo that was away, a transaction at each step, and poll it again.

        One that has kept its torque has kept its memory, too: it is left as it is.
        """
        servo, setup = self._servos[index], self._setups[index]
        images = self._link.read_spans([servo], 0, EEPROM_BYTES, self._patience)
        if servo.id not in images:
            return
        image = images[servo.id].params
        if (number := value_in(servo, image, 0, "model_number")) != setup.model_number:
            self._notice(f"{servo}: another servo answers in its place, of model {number}")
            return
        yield
        told = []
        if servo.wheel is not None:
            self._link.write(servo, "goal_velocity", 0, self._patience)
            yield
        torque = self._link.read(servo, "torque_enable", self._patience)
        if torque != TorqueSwitch.ON:
            told.append("torque is off until it is armed anew")
            for text in write_kept_settings(self._link, servo, image, self._patience):
                told += [text] if text else []
                yield
        self._state.torque_on[index] = torque == TorqueSwitch.ON
        if torque != TorqueSwitch.ON:
            self._state.watchdog[index] = 0
        self._roster.resume(index)
        self._block = self._new_block()
        self.goals.forget_limit(servo.id)
        self._link.counters.returns += 1
        self._notice("; ".join([f"{servo}: answers again", *told]))

    def _notice(self, text: str) -> None:
        if text not in self.notices:
            self.notices.append(text)
