"""Run the firmware of all servos on one bus: power, torque, goals, protection, watchdog.

Events (a write, a fault, a trip) are handled servo by servo; the control loops run over all servos
at once, because they run every physics step.

What the firmware does at the edges: `sim_twin/servos/firmware/reactions.py`. A reboot or loss of
supply gives the RAM its defaults and forgets the turns counted.
"""

from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from drivers.clock import NS_PER_S
from drivers.dynamixel.tables.control_table import (
    Register,
    StatusReturnLevel,
)
from sim_twin.servos.firmware.columns import TableColumns
from sim_twin.servos.firmware.coupling import Coupling
from sim_twin.servos.firmware.feedback import Feedback
from sim_twin.servos.firmware.goal_window import GoalWindow
from sim_twin.servos.firmware.motion import ServoMotion
from sim_twin.servos.firmware.profile import Floats
from sim_twin.servos.firmware.protection import CHECK_PERIOD_S, ServoProtection
from sim_twin.servos.firmware.rail import Rails, SupplyVolts
from sim_twin.servos.firmware.reactions import Reactions
from sim_twin.servos.protocol.register_file import RegisterFile
from sim_twin.servos.spec import EmulatedServoSpec, FirmwareOptions

_CHECK_PERIOD_NS: Final = round(CHECK_PERIOD_S * NS_PER_S)
_BROWNOUT_RATIO: Final = 0.6
"""No servo runs below this share of its nominal voltage (chosen: 3 V of a 5 V servo)."""
_TORQUE_ON_AT_START: Final = 0x01


class Firmware:
    """Own the control tables and everything that changes them from inside."""

    def __init__(
        self,
        specs: Sequence[EmulatedServoSpec],
        options: FirmwareOptions,
        coupling: Coupling | None = None,
        feeds: Sequence[int] | None = None,
    ) -> None:
        self.registers = RegisterFile(specs)
        self._columns = TableColumns(self.registers)
        self._options = options
        joints = coupling or Coupling.direct(len(specs))
        self._motion = ServoMotion(self.registers, self._columns, joints)
        models = [table.model for table in self.registers.tables]
        self._protection = ServoProtection(models, self._columns, options)
        self._rails = Rails(models, options.supply_ohm, feeds)
        self._brownout_v = np.array(
            [min(options.brownout_v, _BROWNOUT_RATIO * model.voltage_v) for model in models]
        )
        self._feedback = Feedback(self._columns, self._motion, self._protection)
        self._reactions = Reactions(
            self.registers,
            self._columns,
            self._motion,
            trip_holds_present=options.trip_holds_present,
        )
        self._goal_window = GoalWindow(self._columns)
        self._boot_until_ns = [0] * len(specs)
        self._powered = np.ones(len(specs), np.bool_)
        self._all_powered = True
        self._pose_known = False
        self._all_readable = False
        self._advanced_ns = 0
        self._checked_ns = 0
        self._supply_v: SupplyVolts = 0.0
        self.now_ns = 0
        for row in range(len(specs)):
            self._boot(row)

    def set_time(self, now_ns: int) -> None:
        """Take over the time, and trip the watchdogs that ran out."""
        self.now_ns = now_ns
        self._reactions.set_time(now_ns)

    def advance(
        self,
        now_ns: int,
        joint_motion: Floats,
        joint_effort: Floats,
        supply_v: SupplyVolts,
    ) -> Floats:
        """Sense, run the control loops and return the duty for the next step.

        The duty counts from the models' nominal voltage: what its rail lacks is taken off.
        """
        if self._reactions.stale:
            self._reload()
        self.now_ns = now_ns
        self._reactions.set_time(now_ns)
        self._motion.sense(joint_motion)
        if not self._pose_known:
            self._take_first_pose()
        dt_s = (now_ns - self._advanced_ns) / NS_PER_S
        self._advanced_ns = now_ns
        self._feedback.sense_effort(joint_effort)
        if supply_v != self._supply_v or now_ns - self._checked_ns >= _CHECK_PERIOD_NS:
            self._supply_v = supply_v
            self._check()
        if self._reactions.stale:
            self._reload()
        return self._motion.advance(max(dt_s, 1e-6))

    @property
    def supply_w(self) -> float:
        """Return what the motors drew at the last look."""
        return self._rails.supply_w

    def couple_anew(self) -> None:
        """Take over a change of the coupling."""
        self._reactions.stale = True

    def answers(self, row: int) -> bool:
        """Return whether a servo is powered and has finished booting."""
        return bool(self._powered[row]) and self.now_ns >= self._boot_until_ns[row]

    def _all_answer(self) -> bool:
        return self._all_powered and self.now_ns >= max(self._boot_until_ns)

    def feed_watchdog(self, rows: Sequence[int]) -> None:
        """Count a packet to these servos as communication."""
        self._reactions.watchdog.feed(rows, self.now_ns)

    def refresh(self, address: int, length: int) -> None:
        """Bring present values within this range up to date."""
        self._feedback.now_ns = self.now_ns
        self._feedback.refresh(address, length)

    def present(self, row: int, name: str) -> int:
        """Return a register's value, up to date."""
        table = self.registers.tables[row]
        item = table.model.registers[name]
        self.refresh(item.address, item.size)
        return table.get(name)

    def store(self, row: int, writes: Sequence[tuple[Register, int]]) -> None:
        """Carry out a host's write that was checked, with all that follows from it."""
        table = self.registers.tables[row]
        for register, value in writes:
            changed = table.get(register.name) != value
            table.put(register.name, value)
            self._reactions.follow_write(row, register.name, changed=changed)

    def read_spans(self, rows: Sequence[int], address: int, length: int) -> list[bytes]:
        """Return up-to-date bytes of several servos, or none unless all of them answer reads."""
        if self._reactions.stale or not (self._all_answer() and self._all_readable):
            return []
        self.refresh(address, length)
        return self.registers.spans(rows, address, length)

    def alerts(self, rows: Sequence[int]) -> list[bool]:
        """Return which of these servos report a hardware error."""
        flags: list[bool] = (self._columns.hardware_error[rows] != 0).tolist()
        return flags

    def take_goals(self, rows: Sequence[int], goals: NDArray[np.int32]) -> bool:
        """Store goal positions of different servos at once, as `store` does one by one.

        Return False, and do nothing, where more than storing is due: a refusal, or a servo whose
        torque is off, whose profile is timed, or that is booting.
        """
        if self._reactions.stale or not (
            self._all_answer() and self._goal_window.admits(rows, goals)
        ):
            return False
        self._columns.goal_position[rows] = goals
        self._motion.goals_moved = True
        return True

    def reboot(self, row: int) -> None:
        """Start the firmware anew; the servo is silent while it boots."""
        self._boot(row)
        self._boot_until_ns[row] = self.now_ns + round(self._options.reboot_s * NS_PER_S)

    def factory_reset(self, row: int, option: int) -> None:
        """Reset the EEPROM, then reboot.

        Raises:
            Refused: the option is unknown.
        """
        self.registers.tables[row].factory_reset(option)
        self.reboot(row)

    def clear_turns(self, row: int) -> bool:
        """Forget the turns counted; False when the servo moves, which forbids it."""
        self.refresh(122, 1)
        if self.registers.tables[row].get("moving"):
            return False
        self._motion.home(row)
        self._reactions.stale = True
        return True

    def raise_errors(self, row: int, bits: int) -> None:
        """Set hardware error bits, and cut torque where Shutdown names one of them."""
        self._reactions.raise_errors(row, bits)

    def heat(self, row: int, celsius: float) -> None:
        """Bring a servo to a temperature, as heat from outside does; it cools from there."""
        self._protection.thermals.heat(row, celsius)

    def force_overload(self, row: int, *, on: bool) -> None:
        """Let a servo count as overloaded whatever its effort, or no longer."""
        self._protection.force_overload(row, on=on)

    def _boot(self, row: int) -> None:
        table = self.registers.tables[row]
        table.power_on()
        self._feedback.booted_ns[row] = self.now_ns
        self._protection.clear_overload(row)
        self._reactions.boot(row)
        if "startup_configuration" in table.model.registers:
            table.put("torque_enable", table.get("startup_configuration") & _TORQUE_ON_AT_START)
        self._reactions.start_watchdog(row)

    def _take_first_pose(self) -> None:
        self._pose_known = True
        self._advanced_ns = self._checked_ns = self.now_ns
        for row in range(len(self.registers)):
            self._motion.home(row)
        self._reactions.stale = True

    def _switch_power(self, powered: NDArray[np.bool_]) -> None:
        changed = np.flatnonzero(powered != self._powered).tolist()
        self._powered, self._all_powered = powered, bool(powered.all())
        for row in changed:
            if powered[row]:
                self.reboot(row)
            else:
                self._reactions.cut_torque(row)

    def _check(self) -> None:
        """Look at voltage, current and temperature, which are slow beside the control loops."""
        motion = self._motion
        volts = self._rails.volts(self._supply_v, motion.duty, motion.shaft_rad_s)
        motion.set_voltage(self._rails.nominal_ratio(volts))
        self._feedback.supply_v = volts
        powered = volts >= self._brownout_v
        if (powered != self._powered).any():
            self._switch_power(powered)
        elapsed_s = (self.now_ns - self._checked_ns) / NS_PER_S
        self._checked_ns = self.now_ns
        effort_ratio = motion.effort_ratio(self._feedback.joint_effort)
        for row, bits in self._protection.check(effort_ratio, volts, elapsed_s):
            if powered[row]:
                self.raise_errors(row, bits)

    def _reload(self) -> None:
        self._reactions.stale = False
        self._motion.reload()
        self._goal_window.reload()
        self._protection.reload()
        levels = self._columns.status_return_level
        self._all_readable = bool((levels >= StatusReturnLevel.READ).all())
