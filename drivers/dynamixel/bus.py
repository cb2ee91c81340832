"""Drive all servos of one Dynamixel bus: one block read and one sync write per cycle."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drivers.base import ByteTransport
from drivers.clock import Clock
from drivers.dynamixel.cycle import ServoCycle
from drivers.dynamixel.handshake import ServoSetup, shake_hands
from drivers.dynamixel.servo import ServoSpec
from drivers.dynamixel.tables.control_table import WATCHDOG_TRIPPED
from drivers.dynamixel.tables.layout import BlockLayout
from drivers.dynamixel.tables.registers import Registers
from drivers.dynamixel.torque import disable_torque, enable_torque, write_kept
from drivers.dynamixel.watchdog import (
    WatchdogEvent,
    WatchdogGuard,
    WatchdogState,
    watchdog_units,
)
from drivers.dynamixel.wire.link import PacketLink
from drivers.errors import DriverError
from drivers.servo.counters import BusCounters
from drivers.servo.fault_policy import FaultPolicy
from drivers.servo.journal import BusJournal
from drivers.servo.members import BusMembers, require_goals
from drivers.servo.state import BusState


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
        layout: BlockLayout = BlockLayout.AUTO,
        watchdog_s: float = 0.1,
        hold_gains: Mapping[str, int] | None = None,
        reply_margin_s: float = 0.002,
        health_every_cycles: int = 5,
        fault_policy: FaultPolicy | None = None,
    ) -> None:
        """Take over the transport; nothing is sent yet.

        `hold_gains` are registers that each servo gets before its torque: a reboot forgets them.
        A `fault_policy` that outlives the bus remembers its reboots when the bus is opened anew.
        `fast_sync` None uses the fast sync read for those servos whose model and firmware have it.

        Raises:
            ValueError: no servo, an id or joint twice, or the watchdog time is out of range.
        """
        self._members = BusMembers(servos)
        self.servos = tuple(servos)
        self.counters = BusCounters()
        self.state = BusState.of(len(servos))
        self.journal = BusJournal(self.servos, self.state, fault_policy or FaultPolicy())
        self._guard = WatchdogGuard()
        self._watchdog_s = watchdog_s
        self._watchdog_units = watchdog_units(watchdog_s)
        self._hold_gains = dict(hold_gains or {})
        self._fast_sync = fast_sync
        self._layout = layout
        self._margin_s = reply_margin_s
        self._health_every_cycles = health_every_cycles
        self._link = PacketLink(transport, clock, baud, self.counters)
        self._registers = Registers(self._link)
        self._cycle: ServoCycle | None = None

    # --- before the first cycle ---------------------------------------------------------------

    def connect(self, *, thorough: bool = True) -> list[ServoSetup]:
        """Check that every servo is the declared one and set it up; torque is left as it is.

        Unless `thorough` it ends with the first silent servo, within a tenth of a second: for those
        who will try again, and have other things to do meanwhile.

        Raises:
            SlowAdapter: the adapter holds back what it receives.
            ServoSilent: names all servos that do not answer.
            WrongServo: names all whose model, firmware or settings are not as declared.
            Rejected: a servo refuses a setting.
            LinkLost: the adapter is gone.
        """
        setups = shake_hands(
            self._registers,
            self.servos,
            fast_sync=self._fast_sync,
            layout=self._layout,
            thorough=thorough,
        )
        self.state.torque_on[:] = [setup.torque_on for setup in setups]
        self.state.error[:] = [setup.error for setup in setups]
        self.state.watchdog[:] = [setup.watchdog for setup in setups]
        self._cycle = ServoCycle(
            self._registers,
            self.servos,
            setups,
            self.state,
            self.journal,
            self._guard,
            watchdog_s=self._watchdog_s,
            margin_s=self._margin_s,
            health_every_cycles=self._health_every_cycles,
        )
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
        cycle = self._cycle or self._connected()
        cycle.read()
        return self.state

    def read_in_turns(self) -> Iterator[None]:
        """Do as `read_state`, but pause whenever a request is on its way; see `BusGroup`.

        Raises:
            DriverError: the bus is not connected.
            LinkLost: the adapter is gone; all values go on growing old with each call.
        """
        return self._connected().read_in_turns()

    def write_goals(self, position_rad: NDArray[np.float64]) -> None:
        """Send a goal to every servo, rounded to pulses and clamped; see `sent_goals`.

        Raises:
            ValueError: a goal is not finite, or there is not one per servo.
            DriverError: the bus is not connected.
            LinkLost: the adapter is gone.
        """
        cycle = self._cycle or self._connected()
        cycle.goals.write(position_rad)

    def write_speeds(self, speed_rad_s: NDArray[np.float64]) -> None:
        """Do nothing: no servo of this bus turns a wheel.

        Raises:
            ValueError: there is a speed.
        """
        require_goals((), speed_rad_s)

    @property
    def sent_goals(self) -> NDArray[np.float64]:
        """Return the goals sent last, after rounding and clamping.

        Raises:
            DriverError: the bus is not connected.
        """
        return self._connected().goals.sent

    def limit_effort(self, ratios: Mapping[int, float]) -> dict[int, DriverError]:
        """Limit servos (by id) to a ratio of full PWM; return those that did not take it.

        Only a changed limit goes on the wire.

        Raises:
            ValueError: a ratio is not within 0..1 or an id is unknown.
            DriverError: the bus is not connected.
            LinkLost: the adapter is gone.
        """
        return self._connected().goals.write_pwm(ratios)

    # --- torque -------------------------------------------------------------------------------

    def enable_torque(self, ids: Sequence[int] | None = None) -> None:
        """Arm the watchdogs and hold servos (all by default) at their present pose.

        Raises:
            WatchdogTripped: clear the watchdog first.
            ServoFault: a servo reports a hardware error.
            ServoSilent: a servo does not answer.
            Rejected: a servo refuses a gain, or (NotKept) a step.
            LinkLost: the adapter is gone.
        """
        chosen = self._members.chosen(ids)
        for index in chosen:
            for name, gain in self._hold_gains.items():
                self._registers.write(self.servos[index], name, gain)
        enable_torque(self._registers, [self.servos[n] for n in chosen], self._watchdog_units)
        for index in chosen:
            self.state.torque_on[index] = True
            self.state.watchdog[index] = self._watchdog_units
        if self._cycle is not None:
            for index in chosen:
                self._cycle.goals.forget_pwm(self.servos[index].id)
        self._forget_status()
        self._guard.note(WatchdogEvent.ARM)

    def disable_torque(self, ids: Sequence[int] | None = None) -> dict[int, DriverError]:
        """Switch servos (all by default) off; every one is tried, failures are returned by id.

        Raises:
            LinkLost: the adapter is gone; armed watchdogs stop the servos.
        """
        chosen = self._members.chosen(ids)
        failures = disable_torque(self._registers, [self.servos[index] for index in chosen])
        for index in chosen:
            self.state.torque_on[index] = self.servos[index].id in failures
        self._forget_status()
        if not self.state.torque_on.any():
            self._guard.note(WatchdogEvent.TORQUE_OFF)
        return failures

    @property
    def watchdog(self) -> WatchdogState:
        """Return the state of the servos' watchdogs."""
        return self._guard.state

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
        write_kept(
            self._registers,
            "bus_watchdog",
            self.servos,
            dict.fromkeys((servo.id for servo in self.servos), 0),
        )
        self.state.watchdog[:] = 0
        self._forget_status()
        self._guard.note(WatchdogEvent.CLEAR)

    def reboot(self, servo_id: int) -> None:
        """Restart a servo and return at once; it rejoins, without torque, when it answers again.

        Raises:
            ValueError: no such servo.
            ServoSilent: it does not answer.
            LinkLost: the adapter is gone.
        """
        (index,) = self._members.chosen([servo_id])
        self._registers.reboot(self.servos[index])
        self.state.torque_on[index] = False
        self.state.watchdog[index] = 0
        if self._cycle is not None:
            self._cycle.suspend(index)

    def telemetry(self) -> dict[str, Any]:
        """Return counters, cycle times and error budgets by name."""
        return {**self.counters.as_dict(), **self.journal.as_dict()}

    @property
    def notices(self) -> tuple[str, ...]:
        """Return what was written to servos and which have come back, the newest last."""
        return () if self._cycle is None else tuple(self._cycle.notices)

    # --- any register -------------------------------------------------------------------------

    def read_register(self, servo_id: int, name: str) -> int:
        """Return a register of one servo, in the servo's units.

        Raises:
            ValueError: no such servo or register.
            ServoSilent: no answer.
            Rejected: the servo refuses.
            LinkLost: the adapter is gone.
        """
        (index,) = self._members.chosen([servo_id])
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
        (index,) = self._members.chosen([servo_id])
        self._registers.write(self.servos[index], name, value)

    # --- inside -------------------------------------------------------------------------------

    def _connected(self) -> ServoCycle:
        if self._cycle is None:
            raise DriverError("the servo bus is not connected; call connect() first")
        return self._cycle

    def _forget_status(self) -> None:
        if self._cycle is not None:
            self._cycle.forget_status()
