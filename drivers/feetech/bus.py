"""Drive all servos of one FEETECH bus: one sync read and one sync write per cycle."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drivers.base import ByteTransport
from drivers.clock import Clock
from drivers.errors import DriverError
from drivers.feetech.codec import FeetechInstruction, encode_packet
from drivers.feetech.cycle import FeetechCycle
from drivers.feetech.link import FeetechLink
from drivers.feetech.servo import FeetechServo
from drivers.feetech.settings import FeetechSetup, set_up_all
from drivers.feetech.torque import switch_torque_off, switch_torque_on
from drivers.feetech.wheels import FeetechWheels
from drivers.servo.counters import BusCounters
from drivers.servo.fault_policy import FaultPolicy
from drivers.servo.journal import BusJournal
from drivers.servo.members import BusMembers
from drivers.servo.state import BusState


class FeetechBus:
    """Own the transport of one bus and everything known of its servos.

    `connect` once, then `read_state` and `write_goals` in every cycle. Nothing waits longer than
    the wire time plus `reply_margin_s` in a cycle. After LinkLost the bus is finished: make a new
    transport and a new bus, and connect.

    These servos have **no bus watchdog**: when the host or the cable dies they keep their torque
    and go on to their last goal, and wheels go on turning. Who opens the bus must not send goals
    that are far ahead. In `state.watchdog` stands 1 for each servo that holds because this bus has
    told it to, 0 for those that were found holding: what another program wrote to them is not
    known.
    """

    def __init__(
        self,
        transport: ByteTransport,
        clock: Clock,
        servos: Sequence[FeetechServo],
        *,
        baud: int,
        reply_margin_s: float = 0.002,
        health_every_cycles: int = 5,
        fault_policy: FaultPolicy | None = None,
    ) -> None:
        """Take over the transport; nothing is sent yet.

        A `fault_policy` that outlives the bus remembers its reboots when the bus is opened anew.

        Raises:
            ValueError: no joint, an id or joint twice, a wheel before a joint, or servos of both
                byte orders.
        """
        self._members = BusMembers(servos)
        _check_byte_order(servos)
        self.servos = tuple(servos)
        self._joint_count = _count_joints(servos)
        self.counters = BusCounters()
        self.state = BusState.of(len(servos))
        self.journal = BusJournal(self.servos, self.state, fault_policy or FaultPolicy())
        self._margin_s = reply_margin_s
        self._health_every_cycles = health_every_cycles
        self._link = FeetechLink(transport, clock, baud, self.counters)
        self._wheels = FeetechWheels(self._link, self.servos[self._joint_count :])
        self._cycle: FeetechCycle | None = None
        self._setups: list[FeetechSetup] = []

    # --- before the first cycle ---------------------------------------------------------------

    def connect(self, *, thorough: bool = True) -> list[FeetechSetup]:
        """Check that every servo is the declared one and set it up; torque is left as it is.

        Wheels, which may turn since somebody else was here, are told to stand still, first of all.
        Unless `thorough` it ends with the first silent servo.

        Raises:
            SlowAdapter: the adapter holds back what it receives.
            ServoSilent: names all servos that do not answer.
            WrongServo: names all whose model, firmware, supply or settings are not as declared.
            NotKept: a servo does not keep a setting.
            LinkLost: the adapter is gone.
        """
        self._wheels.halt()
        self._setups = set_up_all(self._link, self.servos, thorough=thorough)
        self._wheels.confirm_halt()
        self.state.torque_on[:] = [setup.torque_on for setup in self._setups]
        self.state.error[:] = [setup.error for setup in self._setups]
        self._cycle = FeetechCycle(
            self._link,
            self.servos,
            self._setups,
            self.state,
            self.journal,
            margin_s=self._margin_s,
            health_every_cycles=self._health_every_cycles,
        )
        return self._setups

    def close(self) -> None:
        """Release the transport; servos with torque keep it, and go on to their last goal."""
        self._link.close()

    # --- every cycle --------------------------------------------------------------------------

    def read_state(self) -> BusState:
        """Read the block of all servos, and at most one servo's torque switch.

        The returned state is overwritten by the next call. A silent or damaged servo makes its own
        values old, not those of the others.

        Raises:
            DriverError: the bus is not connected.
            LinkLost: the adapter is gone; all values go on growing old with each call.
        """
        self._connected().read()
        return self.state

    def write_goals(self, position_rad: NDArray[np.float64]) -> None:
        """Send a goal to every joint's servo, rounded to pulses and clamped; see `sent_goals`.

        One that has not answered for 50 ms gets none until it has been read again: it would go to
        where nobody knows how far it is.

        Raises:
            ValueError: a goal is not finite, or there is not one per servo.
            DriverError: the bus is not connected.
            LinkLost: the adapter is gone.
        """
        cycle = self._connected()
        cycle.goals.write(position_rad, cycle.silent_rows)

    def write_speeds(self, speed_rad_s: NDArray[np.float64]) -> None:
        """Send a speed to every wheel, rounded to steps and bounded.

        One that has not answered for 50 ms is told to stand still: nobody knows what it does.

        Raises:
            ValueError: a speed is not finite, or there is not one per wheel.
            DriverError: the bus is not connected.
            LinkLost: the adapter is gone.
        """
        silent = self._connected().silent_rows
        self._wheels.write(speed_rad_s, [row - self._joint_count for row in silent])

    @property
    def sent_goals(self) -> NDArray[np.float64]:
        """Return the goals sent last, after rounding and clamping.

        Raises:
            DriverError: the bus is not connected.
        """
        return self._connected().goals.sent

    def limit_effort(self, ratios: Mapping[int, float]) -> dict[int, DriverError]:
        """Limit servos (by id) to a ratio of full duty; return those that did not take it.

        Raises:
            ValueError: a ratio is not within 0..1 or an id is unknown.
            DriverError: the bus is not connected.
            LinkLost: the adapter is gone.
        """
        return self._connected().goals.limit_effort(ratios)

    # --- torque -------------------------------------------------------------------------------

    def enable_torque(self, ids: Sequence[int] | None = None) -> None:
        """Hold servos (all by default) at their present pose.

        Raises:
            ServoFault: a servo reports an error that takes its torque away, or stands outside its
                own position limits.
            ServoSilent: a servo does not answer.
            NotKept: a servo refuses a step.
            DriverError: the bus is not connected.
            LinkLost: the adapter is gone.
        """
        cycle = self._connected()
        chosen = self._members.chosen(ids)
        servos, setups = [self.servos[n] for n in chosen], [self._setups[n] for n in chosen]
        switch_torque_on(self._link, servos, setups)
        for index in chosen:
            self.state.torque_on[index] = True
            self.state.watchdog[index] = 1
            cycle.goals.forget_limit(self.servos[index].id)

    def disable_torque(self, ids: Sequence[int] | None = None) -> dict[int, DriverError]:
        """Switch servos (all by default) off; every one is tried, failures are returned by id.

        Raises:
            LinkLost: the adapter is gone; the servos keep their torque.
        """
        chosen = self._members.chosen(ids)
        failures = switch_torque_off(self._link, [self.servos[index] for index in chosen])
        for index in chosen:
            self.state.torque_on[index] = self.servos[index].id in failures
            self.state.watchdog[index] = 0
        return failures

    def clear_watchdog(self) -> None:
        """Do nothing: these servos never stop by themselves because the bus is silent."""

    def reboot(self, servo_id: int) -> None:
        """Restart a servo and return at once; it rejoins, without torque, when it answers again.

        Raises:
            ValueError: no such servo.
            LinkLost: the adapter is gone.
        """
        (index,) = self._members.chosen([servo_id])
        self._link.send(encode_packet(servo_id, FeetechInstruction.REBOOT))
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
            LinkLost: the adapter is gone.
        """
        (index,) = self._members.chosen([servo_id])
        return self._link.read(self.servos[index], name)

    def write_register(self, servo_id: int, name: str, value: int) -> None:
        """Write a register of one servo, in the servo's units.

        What is EEPROM, and locked as it should be, is forgotten with the servo's power.

        Raises:
            ValueError: no such servo or register, read-only, or the value does not fit it.
            ServoSilent: no answer.
            LinkLost: the adapter is gone.
        """
        (index,) = self._members.chosen([servo_id])
        self._link.write(self.servos[index], name, value)

    # --- inside -------------------------------------------------------------------------------

    def _connected(self) -> FeetechCycle:
        if self._cycle is None:
            raise DriverError("the servo bus is not connected; call connect() first")
        return self._cycle


def _count_joints(servos: Sequence[FeetechServo]) -> int:
    """Return how many servos, the first ones, are joints."""
    count = sum(servo.wheel is None for servo in servos)
    if not count or any(servo.wheel is not None for servo in servos[:count]):
        names = ", ".join(servo.joint for servo in servos)
        raise ValueError(f"a bus needs servos of joints first, then those of wheels, got {names}")
    return count


def _check_byte_order(servos: Sequence[FeetechServo]) -> None:
    orders = {servo.datasheet.byte_order for servo in servos}
    if len(orders) > 1:
        raise ValueError(
            "servos of one bus must be of one kind: STS and SMS send the low byte first, SCS the "
            "high one"
        )
