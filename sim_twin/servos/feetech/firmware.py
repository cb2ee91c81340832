"""Run the firmware of all FEETECH servos on one bus: power, torque, goals, protection.

Events (a write, a fault) are handled servo by servo; the control loops run over all servos at once,
because they run every physics step.

Chosen, because no source says it: at power-on, after a reset of the state and after a calibration
the present position is the goal, so that nothing moves. Torque that is switched on later goes to
the goal that is there, however old it is. A reset of the state keeps the errors. An error that cuts
the torque cuts it again, for as long as it lasts, when a host switches it on.
"""

from collections.abc import Callable, Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from drivers.clock import NS_PER_S
from drivers.feetech.table import (
    CENTRE_STEP,
    FEETECH_CURRENT_UNIT_A,
    FEETECH_VOLTAGE_UNIT_V,
    LOAD_FULL,
    STEPS_PER_REV,
    FeetechMode,
    TorqueSwitch,
)
from sim_twin.servos.feetech.memory import FeetechMemory
from sim_twin.servos.feetech.motion import FeetechMotion
from sim_twin.servos.feetech.protection import FeetechProtection, error_bits
from sim_twin.servos.feetech.spec import EmulatedFeetechSpec, FeetechOptions
from sim_twin.servos.firmware.coupling import Coupling
from sim_twin.servos.firmware.profile import Floats
from sim_twin.servos.firmware.rail import Rails, SupplyVolts

_CHECK_PERIOD_NS: Final = 20_000_000
_EFFORT_SMOOTHING: Final = 0.25
_MOST_OFFSET: Final = 2047
_LEAST_MOVING_STEP_S: Final = 20.0
"""A servo that turns more slowly counts as standing (chosen)."""
_GOALS: Final = frozenset(
    {"goal_position", "goal_time", "goal_velocity", "acceleration", "torque_limit"}
)
_ROSTER: Final = frozenset({"id", "baud_rate"})


class FeetechFirmware:
    """Own the control tables and everything that changes them from inside.

    `on_roster` is called when ids or baud rates may have changed.
    """

    def __init__(
        self,
        specs: Sequence[EmulatedFeetechSpec],
        options: FeetechOptions,
        coupling: Coupling | None = None,
        feeds: Sequence[int] | None = None,
    ) -> None:
        count = len(specs)
        self.memory = memory = FeetechMemory(specs)
        self.on_roster: Callable[[], None] = lambda: None
        self._options = options
        joints = coupling or Coupling.direct(count)
        self._joint_stall_nm = joints.sign * [sheet.stall_torque_nm for sheet in memory.sheets]
        self._motion = FeetechMotion(memory, joints)
        self._protection = FeetechProtection(memory, options.ambient_c)
        self._rails = Rails(memory.sheets, options.supply_ohm, feeds)
        self._joint_effort = np.zeros(count)
        self._held: dict[int, tuple[int, bytes]] = {}
        self._boot_until_ns = [0] * count
        self._unhomed = set(range(count))
        self._powered = np.ones(count, np.bool_)
        self._stale = True
        self._goals_moved = False
        self._feedback_is_fresh = False
        self._supply_v: SupplyVolts | None = None
        self._rail_v = np.array([sheet.voltage_v for sheet in memory.sheets])
        self._advanced_ns: int | None = None
        self._checked_ns = 0
        self.now_ns = 0

    def set_time(self, now_ns: int) -> None:
        """Take over the time."""
        self.now_ns = now_ns

    def advance(
        self, now_ns: int, joint_motion: Floats, joint_effort: Floats, supply_v: SupplyVolts
    ) -> Floats:
        """Sense, run the control loops and return the duty for the next step.

        The duty counts from the models' nominal voltage: what its rail lacks is taken off.
        """
        self.now_ns = now_ns
        if self._advanced_ns is None:
            self._advanced_ns = self._checked_ns = now_ns
        dt_s, self._advanced_ns = (now_ns - self._advanced_ns) / NS_PER_S, now_ns
        self._take_changes()
        self._motion.sense(joint_motion)
        if self._unhomed:
            self._home(joint_motion)
        self._joint_effort += (joint_effort - self._joint_effort) * _EFFORT_SMOOTHING
        if supply_v != self._supply_v or now_ns - self._checked_ns >= _CHECK_PERIOD_NS:
            self._supply_v = supply_v
            self._check(supply_v)
        self._feedback_is_fresh = False
        return self._motion.advance(max(dt_s, 1e-6))

    @property
    def supply_w(self) -> float:
        """Return what the motors drew at the last look."""
        return self._rails.supply_w

    def couple_anew(self) -> None:
        """Take over a change of the coupling."""
        self._stale = True

    def answers(self, row: int) -> bool:
        """Return whether a servo is powered and has finished booting."""
        return bool(self._powered[row]) and self.now_ns >= self._boot_until_ns[row]

    def error_byte(self, row: int) -> int:
        """Return the error byte of a servo's answers."""
        return int(self._protection.errors[row])

    def present(self, row: int, name: str) -> int:
        """Return a register's value, up to date."""
        self._write_feedback()
        return self.memory.get(row, name)

    def read(self, row: int, address: int, count: int) -> bytes | None:
        """Return what a host's read finds; None where a servo does not answer it."""
        self._write_feedback()
        return self.memory.read(row, address, count)

    def store(self, row: int, address: int, data: bytes) -> None:
        """Carry out a host's write, with all that follows from it."""
        torque = self.memory.get(row, "torque_enable")
        written = set(self.memory.write(row, address, data))
        self._feedback_is_fresh = False
        if written & _GOALS:
            self._goals_moved = True
        if written - _GOALS:
            self._stale = True
        if "operating_mode" in written:
            self._restart(row)
        if "torque_enable" in written:
            self._on_torque(row, torque)
        if "goal_position" in written and self._is_in_step_mode(row):
            self._motion.step_on(row, self.memory.get(row, "goal_position"))
        if written & _ROSTER:
            self.on_roster()

    def hold(self, row: int, address: int, data: bytes) -> None:
        """Keep a write until `release`."""
        self._held[row] = address, data
        self.memory.put(row, "registered_instruction", 1)

    def release(self, row: int) -> None:
        """Carry out the write that was kept, if there is one."""
        self.memory.put(row, "registered_instruction", 0)
        if row in self._held:
            self.store(row, *self._held.pop(row))

    def reboot(self, row: int) -> None:
        """Start the firmware anew; the servo is silent while it boots."""
        self.memory.power_on(row)
        self._held.pop(row, None)
        self._protection.clear(row)
        self._unhomed.add(row)
        self._stale = True
        self._boot_until_ns[row] = self.now_ns + round(self._options.reboot_s * NS_PER_S)
        self.on_roster()

    def restore(self, row: int) -> None:
        """Bring the backup back, or the factory's values."""
        self.memory.restore(row)
        self._stale = True
        self.on_roster()

    def reset_state(self, row: int) -> None:
        """Forget the turns counted and the write that was kept."""
        self._held.pop(row, None)
        self.memory.put(row, "registered_instruction", 0)
        self._unhomed.add(row)

    def calibrate(self, row: int, step: int) -> None:
        """Let the present position be `step`, by the homing offset, for good."""
        if "homing_offset" not in self.memory.sheets[row].registers:
            return
        present = int(self._motion.steps[row]) + self.memory.get(row, "homing_offset")
        offset = (present - step + CENTRE_STEP) % STEPS_PER_REV - CENTRE_STEP
        self.memory.put(row, "homing_offset", max(offset, -_MOST_OFFSET))
        self.memory.keep(row, "homing_offset")
        self._unhomed.add(row)
        self._stale = True

    def raise_errors(self, row: int, bits: int) -> None:
        """Hold bits of `HardwareError`, with what the shutdown register makes of them.

        Raises:
            ValueError: these servos have no such error.
        """
        self._protection.hold(row, error_bits(bits))
        self._act_on_errors()

    def heat(self, row: int, celsius: float) -> None:
        """Bring a servo to a temperature, as heat from outside does; it cools from there."""
        self._protection.thermals.heat(row, celsius)

    def force_overload(self, row: int, *, on: bool) -> None:
        """Let a servo count as overloaded whatever its load, or no longer."""
        self._protection.force_overload(row, on=on)

    # What follows from a write

    def _is_in_step_mode(self, row: int) -> bool:
        return self.memory.get(row, "operating_mode") == FeetechMode.STEP

    def _on_torque(self, row: int, before: int) -> None:
        torque = self.memory.get(row, "torque_enable")
        if torque == TorqueSwitch.CENTRE_HERE:
            self.memory.put(row, "torque_enable", before)
            self.calibrate(row, CENTRE_STEP)
        elif torque == TorqueSwitch.FREE and self._options.torque_off_clears_overload:
            self._protection.clear(row)
        elif torque == TorqueSwitch.ON and before != TorqueSwitch.ON:
            self._restart(row)
            self._act_on_errors()

    def _restart(self, row: int) -> None:
        """Let the loops begin at the present position, as the registers are now."""
        self._take_changes()
        self._motion.restart(row)

    # What happens by itself

    def _take_changes(self) -> None:
        if self._stale:
            self._stale = self._goals_moved = False
            self._motion.reload()
            self._protection.reload()
            self._motion.cap = self._protection.cap
        elif self._goals_moved:
            self._goals_moved = False
            self._motion.reload_goals()

    def _home(self, joint_motion: Floats) -> None:
        """Begin with the present pose, whatever the goal was."""
        rows, self._unhomed = sorted(self._unhomed), set()
        self._motion.home(rows)
        self._motion.reload()
        self._motion.sense(joint_motion)
        for row in rows:
            self.memory.put(row, "goal_position", int(self._motion.steps[row]))
            self._motion.restart(row)
        self._motion.reload_goals()

    def _check(self, supply_v: SupplyVolts) -> None:
        """Look at voltage, current and temperature, which are slow compared to control."""
        motion = self._motion
        self._rail_v = self._rails.volts(supply_v, motion.shaft_duty, motion.shaft_rad_s)
        motion.set_voltage(self._rails.nominal_ratio(self._rail_v))
        powered = self._rail_v >= self._options.brownout_v
        if (powered != self._powered).any():
            self._switch_power(powered)
        elapsed_s = (self.now_ns - self._checked_ns) / NS_PER_S
        self._checked_ns = self.now_ns
        effort_ratio = self._joint_effort / self._joint_stall_nm
        self._protection.check(effort_ratio, motion.pwm, self._rail_v, elapsed_s)
        self._act_on_errors()
        self._take_changes()

    def _act_on_errors(self) -> None:
        """Take torque away, or all but a little of it, as the shutdown register says."""
        self._motion.cap = self._protection.cap
        for row in np.flatnonzero(self._protection.tripped).tolist():
            if self.memory.get(row, "torque_enable"):
                self.memory.put(row, "torque_enable", TorqueSwitch.FREE)
                self._stale = True

    def _switch_power(self, powered: NDArray[np.bool_]) -> None:
        """Boot servos, or take their power: either way they forget what is not kept."""
        changed = np.flatnonzero(powered != self._powered).tolist()
        self._powered = powered
        for row in changed:
            self.reboot(row)

    def _write_feedback(self) -> None:
        """Write what the servos sense into their tables, at most once a step."""
        if self._feedback_is_fresh:
            return
        self._feedback_is_fresh = True
        motion, put = self._motion, self.memory.put_column
        put("present_position", motion.steps)
        put("present_velocity", motion.speed_units)
        put("present_load", motion.pwm * LOAD_FULL)
        put("present_voltage", self._rail_v / FEETECH_VOLTAGE_UNIT_V)
        put("present_temperature", self._protection.thermals.body_c)
        put("hardware_error_status", self._protection.errors)
        put("moving", np.abs(motion.speed_step_s) > _LEAST_MOVING_STEP_S)
        put("target_position", motion.goal)
        current_a = self._protection.current_a(self._joint_effort / self._joint_stall_nm)
        put("present_current", current_a / FEETECH_CURRENT_UNIT_A)
