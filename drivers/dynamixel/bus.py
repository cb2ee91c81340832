"""Drive all servos of one Dynamixel bus: one block read and one sync write per cycle."""

from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Final, TypeVar

import numpy as np
from numpy.typing import NDArray

from drivers.base import ByteTransport
from drivers.clock import NS_PER_S, Clock
from drivers.dynamixel.control_table import WATCHDOG_TRIPPED
from drivers.dynamixel.counters import BusCounters
from drivers.dynamixel.fault_policy import FaultPolicy
from drivers.dynamixel.goals import GoalWriter
from drivers.dynamixel.group import ServoRead
from drivers.dynamixel.handshake import ServoSetup, shake_hands
from drivers.dynamixel.health import HealthPoll
from drivers.dynamixel.journal import BusJournal
from drivers.dynamixel.layout import DIRECT, Layout
from drivers.dynamixel.link import Link, Patience
from drivers.dynamixel.reader import StateReader
from drivers.dynamixel.registers import Registers
from drivers.dynamixel.roster import Roster
from drivers.dynamixel.servo import ServoSpec
from drivers.dynamixel.settings import bring_back
from drivers.dynamixel.state import BusState
from drivers.dynamixel.torque import disable_torque, enable_torque, write_kept
from drivers.dynamixel.watchdog import WatchdogEvent, WatchdogState, next_state, watchdog_units
from drivers.errors import DriverError, LinkLost

_GAP_WARNING_RATIO: Final = 0.8
_MOST_NOTICES: Final = 64
Part = TypeVar("Part")


class DynamixelBus:
    """Own the transport of one bus and everything known of its servos.

    `connect` once, then `read_state` and `write_goals` in every cycle. Nothing waits longer than
    the wire time plus `reply_margin_s` in a cycle. After LinkLost the bus is finished: make a new
    transport and a new bus, and connect; torque stays off or on as the servos left it.
    """

    def __init__(
        self,
        transport: ByteTransport,
        clock: Clock,
        servos: Sequence[ServoSpec],
        *,
        baud: int,
        fast_sync: bool | None = None,
        layout: Layout = Layout.AUTO,
        watchdog_s: float = 0.1,
        reply_margin_s: float = 0.002,
        health_every_cycles: int = 5,
        fault_policy: FaultPolicy | None = None,
    ) -> None:
        """Take over the transport; nothing is sent yet.

        A `fault_policy` that outlives the bus remembers its reboots when the bus is opened anew.
        `fast_sync` None uses the fast sync read for those servos whose model and firmware have it.

        Raises:
            ValueError: no servo, an id or joint twice, or the watchdog time is out of range.
        """
        _check_servos(servos)
        self.servos = tuple(servos)
        self.counters = BusCounters()
        self.state = BusState.of(len(servos))
        self.journal = BusJournal(self.servos, self.state, fault_policy or FaultPolicy())
        self.watchdog = WatchdogState.OFF
        self._by_id = {servo.id: index for index, servo in enumerate(servos)}
        self._watchdog_units = watchdog_units(watchdog_s)
        self._gap_ns = round(watchdog_s * _GAP_WARNING_RATIO * NS_PER_S)
        self._fast_sync = fast_sync
        self._layout = layout
        self._margin_s = reply_margin_s
        self._health_every_cycles = health_every_cycles
        self._link = Link(transport, clock, baud, self.counters)
        self._registers = Registers(self._link)
        self._roster = Roster(len(servos))
        self._setups: list[ServoSetup] = []
        self._reader: StateReader | None = None
        self._health: HealthPoll | None = None
        self._goals: GoalWriter | None = None
        self._notices: deque[str] = deque(maxlen=_MOST_NOTICES)

    # --- before the first cycle ---------------------------------------------------------------

    def connect(self) -> list[ServoSetup]:
        """Check that every servo is the declared one and set it up; torque is left as it is.

        Raises:
            SlowAdapter: the adapter holds back what it receives.
            ServoSilent: names all servos that do not answer.
            WrongServo: names all whose model, firmware or settings are not as declared.
            Rejected: a servo refuses a setting.
            LinkLost: the adapter is gone.
        """
        setups = shake_hands(
            self._registers, self.servos, fast_sync=self._fast_sync, layout=self._layout
        )
        self._setups = setups
        self._make_parts(setups)
        for servo, setup in zip(self.servos, setups, strict=True):
            self._notices += [f"{servo}: set {text}" for text in setup.written]
        self.state.torque_on[:] = [setup.torque_on for setup in setups]
        self.state.error[:] = [setup.error for setup in setups]
        self.state.watchdog[:] = [setup.watchdog for setup in setups]
        self._note_watchdogs()
        return setups

    def close(self) -> None:
        """Release the transport; torque is left as it is, and the watchdogs stop the servos."""
        self._link.close()

    # --- every cycle --------------------------------------------------------------------------

    def read_state(self) -> BusState:
        """Read the block of all servos, and at most one servo's slow registers.

        The returned state is overwritten by the next call. A silent or damaged servo makes its own
        values old, not those of the others.

        Raises:
            DriverError: the bus is not connected.
            LinkLost: the adapter is gone; all values go on growing old with each call.
        """
        reader = self._connected(self._reader)
        silent_ns = self._link.now_ns() - self._link.last_sent_ns
        try:
            reader.read()
        except LinkLost:
            reader.note_silence()
            raise
        return self._look_after(silent_ns)

    def read_in_turns(self) -> Iterator[None]:
        """Do as `read_state`, but pause whenever a request is on its way; see `BusGroup`.

        Raises:
            DriverError: the bus is not connected.
            LinkLost: the adapter is gone; all values go on growing old with each call.
        """
        reader = self._connected(self._reader)
        silent_ns = self._link.now_ns() - self._link.last_sent_ns
        try:
            yield from reader.read_in_turns()
        except LinkLost:
            reader.note_silence()
            raise
        self._look_after(silent_ns)

    def write_goals(self, position_rad: NDArray[np.float64]) -> NDArray[np.float64]:
        """Send a goal to every servo; return what was sent after rounding and clamping.

        Raises:
            ValueError: a goal is not finite, or there is not one per servo.
            DriverError: the bus is not connected.
            LinkLost: the adapter is gone.
        """
        return self._connected(self._goals).write(position_rad)

    def write_goal_pwm(self, ratios: Mapping[int, float]) -> dict[int, DriverError]:
        """Limit servos (by id) to a ratio of full PWM; return those that did not take it.

        Only a changed limit goes on the wire.

        Raises:
            ValueError: a ratio is not within 0..1 or an id is unknown.
            DriverError: the bus is not connected.
            LinkLost: the adapter is gone.
        """
        return self._connected(self._goals).write_pwm(ratios)

    # --- torque -------------------------------------------------------------------------------

    def enable_torque(self, ids: Sequence[int] | None = None) -> None:
        """Arm the watchdogs and hold servos (all by default) at their present pose.

        Raises:
            WatchdogTripped: clear the watchdog first.
            ServoFault: a servo reports a hardware error.
            ServoSilent: a servo does not answer.
            NotKept: a servo refuses a step.
            LinkLost: the adapter is gone.
        """
        chosen = self._chosen(ids)
        enable_torque(self._registers, [self.servos[n] for n in chosen], self._watchdog_units)
        for index in chosen:
            self.state.torque_on[index] = True
            self.state.watchdog[index] = self._watchdog_units
            self._forget_pwm(index)
        self._forget_status()
        self.watchdog = next_state(self.watchdog, WatchdogEvent.ARM)

    def disable_torque(self, ids: Sequence[int] | None = None) -> dict[int, DriverError]:
        """Switch servos (all by default) off; every one is tried, failures are returned by id.

        Raises:
            LinkLost: the adapter is gone; armed watchdogs stop the servos.
        """
        chosen = self._chosen(ids)
        failures = disable_torque(self._registers, [self.servos[index] for index in chosen])
        for index in chosen:
            self.state.torque_on[index] = self.servos[index].id in failures
        self._forget_status()
        if not self.state.torque_on.any():
            self.watchdog = next_state(self.watchdog, WatchdogEvent.TORQUE_OFF)
        return failures

    @property
    def watchdog_tripped(self) -> tuple[str, ...]:
        """Name the joints whose servo has stopped by itself."""
        tripped = np.flatnonzero(self.state.watchdog == WATCHDOG_TRIPPED)
        return tuple(self.servos[index].joint for index in tripped)

    def clear_watchdog(self) -> None:
        """Make tripped servos take goals again; enable torque next, which re-arms them.

        Raises:
            ServoSilent: a servo does not answer.
            NotKept: a servo refuses.
            LinkLost: the adapter is gone.
        """
        write_kept(self._registers, "bus_watchdog", self.servos, dict.fromkeys(self._by_id, 0))
        self.state.watchdog[:] = 0
        self._forget_status()
        self.watchdog = next_state(self.watchdog, WatchdogEvent.CLEAR)

    def reboot(self, servo_id: int) -> None:
        """Restart a servo and return at once; it rejoins, without torque, when it answers again.

        Raises:
            ValueError: no such servo.
            ServoSilent: it does not answer.
            LinkLost: the adapter is gone.
        """
        (index,) = self._chosen([servo_id])
        self._registers.reboot(self.servos[index])
        self.state.torque_on[index] = False
        self.state.watchdog[index] = 0
        self._suspend(index)

    def telemetry(self) -> dict[str, Any]:
        """Return counters, cycle times and error budgets by name."""
        return {**self.counters.as_dict(), **self.journal.as_dict()}

    @property
    def notices(self) -> tuple[str, ...]:
        """Return what was written to servos and which have come back, the newest last."""
        return tuple(self._notices)

    # --- any register -------------------------------------------------------------------------

    def read_register(self, servo_id: int, name: str) -> int:
        """Return a register of one servo, in the servo's units.

        Raises:
            ValueError: no such servo or register.
            ServoSilent: no answer.
            Rejected: the servo refuses.
            LinkLost: the adapter is gone.
        """
        (index,) = self._chosen([servo_id])
        return self._registers.read(self.servos[index], name)

    def write_register(self, servo_id: int, name: str, value: int) -> None:
        """Write a register of one servo, in the servo's units.

        Raises:
            ValueError: no such servo or register, read-only, or the value does not fit its bytes.
            RejectedAccess: EEPROM while torque is on.
            RejectedRange: out of range, or the watchdog has tripped.
            RejectedLimit: beyond a limit register.
            ServoSilent: no answer.
            LinkLost: the adapter is gone.
        """
        (index,) = self._chosen([servo_id])
        self._registers.write(self.servos[index], name, value)

    # --- inside -------------------------------------------------------------------------------

    def _make_parts(self, setups: Sequence[ServoSetup]) -> None:
        reads = [
            ServoRead(spec=servo, block=setup.block, fast=setup.fast_sync)
            for servo, setup in zip(self.servos, setups, strict=True)
        ]
        self._roster = Roster(len(self.servos))
        self._reader = StateReader(
            self._link,
            reads,
            self._roster,
            self.state,
            self.journal,
            margin_s=self._margin_s,
            on_lost_map=self._take_back,
        )
        self._health = HealthPoll(
            self._registers,
            self.servos,
            self._roster,
            self.state,
            asked=[n for n, setup in enumerate(setups) if setup.block is DIRECT],
            every_cycles=self._health_every_cycles,
            margin_s=self._margin_s,
            bring_back=self._bring_back,
        )
        self._goals = GoalWriter(
            self._link, self._registers, self.servos, setups, margin_s=self._margin_s
        )

    def _connected(self, part: Part | None) -> Part:
        if part is None:
            raise DriverError("the servo bus is not connected; call connect() first")
        return part

    def _look_after(self, silent_ns: int) -> BusState:
        if self.watchdog is WatchdogState.ARMED and silent_ns > self._gap_ns:
            self._read_watchdogs()
        health = self._connected(self._health)
        errors, status = self._connected(self._reader).take_news()
        if errors:
            health.note_alerts()
        if health.step() or status or errors:
            self._note_watchdogs()
            self.journal.note_errors()
        return self.state

    def _chosen(self, ids: Sequence[int] | None) -> list[int]:
        if ids is None:
            return list(range(len(self.servos)))
        unknown = sorted(set(ids) - set(self._by_id))
        if unknown:
            raise ValueError(f"no servo {unknown} on this bus; it has {sorted(self._by_id)}")
        return [self._by_id[servo_id] for servo_id in ids]

    def _read_watchdogs(self) -> None:
        values = self._registers.read_many("bus_watchdog", self.servos)
        for servo_id, value in values.items():
            self.state.watchdog[self._by_id[servo_id]] = value
        self._note_watchdogs()

    def _note_watchdogs(self) -> None:
        if (self.state.watchdog == WATCHDOG_TRIPPED).any():
            self.watchdog = next_state(self.watchdog, WatchdogEvent.TRIP)

    def _suspend(self, index: int) -> None:
        self._roster.suspend(index)
        if self._reader is not None:
            self._reader.rebuild()

    def _take_back(self, index: int) -> None:
        """Set up a servo that answers but has forgotten its setup."""
        self._suspend(index)
        self.state.torque_on[index] = False
        self._connected(self._health).expect(index)

    def _bring_back(self, index: int) -> Iterator[None]:
        servo, setup = self.servos[index], self._setups[index]
        patience = Patience(margin_s=self._margin_s, attempts=2)
        told = []
        for text in bring_back(self._registers, servo, setup.block, patience):
            told += [text] if text else []
            yield
        self._resume(index)
        self.counters.returns += 1
        self._notices.append("; ".join([f"{servo}: answers again", *told]))

    def _resume(self, index: int) -> None:
        self._roster.resume(index)
        self._connected(self._reader).rebuild()
        self._forget_pwm(index)
        self._connected(self._health).ask_soon(index)

    def _forget_status(self) -> None:
        if self._reader is not None:
            self._reader.forget_status()

    def _forget_pwm(self, index: int) -> None:
        if self._goals is not None:
            self._goals.forget_pwm(self.servos[index].id)


def _check_servos(servos: Sequence[ServoSpec]) -> None:
    if not servos:
        raise ValueError("a servo bus needs at least one servo, got none")
    _check_unique("id", [str(servo.id) for servo in servos])
    _check_unique("joint", [servo.joint for servo in servos])


def _check_unique(what: str, values: list[str]) -> None:
    twice = sorted({value for value in values if values.count(value) > 1})
    if twice:
        raise ValueError(f"each servo needs its own {what}, got twice: {', '.join(twice)}")
