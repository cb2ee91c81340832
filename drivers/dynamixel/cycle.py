"""Run what a connected bus does in every cycle, and bring servos back that were away."""

from collections import deque
from collections.abc import Iterator, Sequence
from typing import Final

from drivers.clock import NS_PER_S
from drivers.dynamixel.goals import GoalWriter
from drivers.dynamixel.group import ServoRead
from drivers.dynamixel.handshake import ServoSetup
from drivers.dynamixel.health import HealthPoll
from drivers.dynamixel.reader import StateReader
from drivers.dynamixel.servo import ServoSpec
from drivers.dynamixel.tables.control_table import WATCHDOG_TRIPPED
from drivers.dynamixel.tables.layout import DIRECT
from drivers.dynamixel.tables.registers import Registers
from drivers.dynamixel.tables.settings import bring_back
from drivers.dynamixel.watchdog import WatchdogEvent, WatchdogGuard, WatchdogState
from drivers.errors import LinkLost
from drivers.servo.journal import BusJournal
from drivers.servo.patience import ReplyPatience
from drivers.servo.roster import Roster
from drivers.servo.state import BusState

_GAP_WARNING_RATIO: Final = 0.8
_MOST_NOTICES: Final = 64


class ServoCycle:
    """Read all servos, look after those that need it, and write goals.

    `notices` tell what was written to servos and which have come back, the newest last.
    """

    def __init__(
        self,
        registers: Registers,
        servos: Sequence[ServoSpec],
        setups: Sequence[ServoSetup],
        state: BusState,
        journal: BusJournal,
        guard: WatchdogGuard,
        *,
        watchdog_s: float,
        margin_s: float,
        health_every_cycles: int,
    ) -> None:
        """Work on servos that were set up as `setups` says."""
        self._registers = registers
        self._link = registers.link
        self._servos = servos
        self._setups = setups
        self._state = state
        self._journal = journal
        self._guard = guard
        self._gap_ns = round(watchdog_s * _GAP_WARNING_RATIO * NS_PER_S)
        self._margin_s = margin_s
        self._roster = Roster(len(servos))
        self.notices: deque[str] = deque(maxlen=_MOST_NOTICES)
        for servo, setup in zip(servos, setups, strict=True):
            self.notices += [f"{servo}: set {text}" for text in setup.written]
        self._reader = StateReader(
            self._link,
            _reads(servos, setups),
            self._roster,
            state,
            journal,
            margin_s=margin_s,
            on_lost_map=self._take_back,
        )
        self._news = self._reader.news
        self._health = HealthPoll(
            registers,
            servos,
            self._roster,
            state,
            asked=[n for n, setup in enumerate(setups) if setup.block is DIRECT],
            every_cycles=health_every_cycles,
            margin_s=margin_s,
            bring_back=self._bring_back,
        )
        self.goals = GoalWriter(self._link, registers, servos, setups, margin_s=margin_s)
        self._note_watchdogs()

    def read(self) -> None:
        """Read the block of all servos, and at most one servo's slow registers.

        Raises:
            LinkLost: the adapter is gone; all values go on growing old with each call.
        """
        silent_ns = self._silent_ns()
        try:
            self._reader.read()
        except LinkLost:
            self._reader.note_silence()
            raise
        self._look_after(silent_ns)

    def read_in_turns(self) -> Iterator[None]:
        """Do as `read`, but pause whenever a request is on its way.

        Raises:
            LinkLost: the adapter is gone; all values go on growing old with each call.
        """
        silent_ns = self._silent_ns()
        try:
            yield from self._reader.read_in_turns()
        except LinkLost:
            self._reader.note_silence()
            raise
        self._look_after(silent_ns)

    def suspend(self, index: int) -> None:
        """Take a servo out of the block read; it rejoins when it answers again."""
        self._roster.suspend(index)
        self._reader.rebuild()

    def forget_status(self) -> None:
        """Take the next status of every servo for news: the state was changed meanwhile."""
        self._reader.forget_status()

    def _silent_ns(self) -> int:
        """Return for how long nothing was sent, where a watchdog may have noticed."""
        if self._guard.state is not WatchdogState.ARMED:
            return 0
        return self._link.now_ns() - self._link.last_sent_ns

    def _look_after(self, silent_ns: int) -> None:
        if silent_ns > self._gap_ns:
            self._read_watchdogs()
        news = self._news
        if news.errors:
            self._health.note_alerts()
        if self._health.step() or news.errors or news.status:
            news.errors = news.status = False
            self._note_watchdogs()
            self._journal.note_errors()

    def _read_watchdogs(self) -> None:
        values = self._registers.read_many("bus_watchdog", self._servos)
        for index, servo in enumerate(self._servos):
            self._state.watchdog[index] = values.get(servo.id, self._state.watchdog[index])
        self._note_watchdogs()

    def _note_watchdogs(self) -> None:
        if (self._state.watchdog == WATCHDOG_TRIPPED).any():
            self._guard.note(WatchdogEvent.TRIP)

    def _take_back(self, index: int) -> None:
        """Set up a servo that answers but has forgotten its setup."""
        self.suspend(index)
        self._state.torque_on[index] = False
        self._health.expect(index)

    def _bring_back(self, index: int) -> Iterator[None]:
        servo, setup = self._servos[index], self._setups[index]
        patience = ReplyPatience(margin_s=self._margin_s, attempts=2)
        told = []
        for text in bring_back(self._registers, servo, setup.block, patience):
            told += [text] if text else []
            yield
        self._resume(index)
        self._link.counters.returns += 1
        self.notices.append("; ".join([f"{servo}: answers again", *told]))

    def _resume(self, index: int) -> None:
        self._roster.resume(index)
        self._reader.rebuild()
        self.goals.forget_pwm(self._servos[index].id)
        self._health.ask_soon(index)


def _reads(servos: Sequence[ServoSpec], setups: Sequence[ServoSetup]) -> list[ServoRead]:
    return [
        ServoRead(spec=servo, block=setup.block, fast=setup.fast_sync)
        for servo, setup in zip(servos, setups, strict=True)
    ]
