"""Drive one Dynamixel gently: its goal PWM (100) bounds the duty until its power is cut.

e-manual, "Goal PWM": in the position modes it limits the output. The Bus Watchdog stops the servo
when the bench falls silent.
"""

from typing import Final

from drivers.dynamixel.servo import ServoSpec
from drivers.dynamixel.tables.model import PULSES_PER_REV, PWM_FULL, OperatingMode
from drivers.dynamixel.tables.registers import Registers, decode
from drivers.dynamixel.torque import HOLD_GAINS, disable_torque, enable_torque
from drivers.dynamixel.watchdog import watchdog_units
from drivers.servo.errors import WrongServo
from drivers.servo.tools.gentle_drive import DRIVE_WATCHDOG_S, DrivenSample

_PROFILE: Final = ("profile_acceleration", "profile_velocity")
_BORROWED: Final = (*HOLD_GAINS, *_PROFILE, "goal_pwm")
_POSITION_MODES: Final = {
    OperatingMode.POSITION,
    OperatingMode.EXTENDED_POSITION,
    OperatingMode.CURRENT_BASED_POSITION,
}
_SENSED: Final = (124, 12)  # present_pwm .. present_position


class DynamixelDrive:
    """Drive a servo of a bench's bus; nothing is written before `hold`."""

    def __init__(self, registers: Registers, servo: ServoSpec, torque_ratio: float) -> None:
        """Read what will be changed.

        Raises:
            WrongServo: it is in no position mode.
            ServoSilent: no answer.
            LinkLost: the adapter is gone.
        """
        self._registers = registers
        self._servo = servo
        self._limit = round(torque_ratio * PWM_FULL)
        mode = registers.read(servo, "operating_mode")
        if mode not in _POSITION_MODES:
            raise WrongServo(f"{servo}: expected operating_mode 3, position; got {mode}")
        self._held = bool(registers.read(servo, "torque_enable"))
        self._before = {name: registers.read(servo, name) for name in _BORROWED}
        turn = self.sense().pulse // PULSES_PER_REV * PULSES_PER_REV
        self.pulse_range = turn, turn + PULSES_PER_REV - 1
        """Between which pulses the servo takes goals; where it counts turns, of the present one."""
        if mode == OperatingMode.POSITION:
            self.pulse_range = (
                registers.read(servo, "min_position_limit"),
                registers.read(servo, "max_position_limit"),
            )

    def hold(self) -> None:
        """Bound the torque, then hold the servo where it is, guarded by its Bus Watchdog.

        Raises:
            ServoFault: it reports an error that takes its torque away.
            ServoSilent: no answer.
            Rejected: it refuses a step, such as a pose outside its position limits.
            LinkLost: the adapter is gone.
        """
        write = self._registers.write
        write(self._servo, "bus_watchdog", 0)  # one that has tripped takes no goals
        write(self._servo, "goal_pwm", self._limit)
        for name in _PROFILE:
            write(self._servo, name, 0)
        for name, gain in HOLD_GAINS.items():
            write(self._servo, name, gain)
        enable_torque(self._registers, [self._servo], watchdog_units(DRIVE_WATCHDOG_S))

    def go_to(self, pulse: int) -> None:
        """Give the servo a goal.

        Raises:
            Rejected: it refuses, as after its watchdog has tripped.
            ServoSilent: no answer.
            LinkLost: the adapter is gone.
        """
        self._registers.write(self._servo, "goal_position", pulse)

    def sense(self) -> DrivenSample:
        """Ask where the servo is, and what it gives.

        Raises:
            ServoSilent: no answer.
            LinkLost: the adapter is gone.
        """
        span = self._registers.read_span(self._servo, *_SENSED)
        return DrivenSample(
            pulse=decode(self._servo, span, _SENSED[0], "present_position"),
            duty_ratio=decode(self._servo, span, _SENSED[0], "present_pwm") / PWM_FULL,
        )

    def let_go(self) -> None:
        """Take the torque away, or hold where it held before, and put everything else back.

        The watchdog is off afterwards: there is nobody who feeds it.

        Raises:
            ServoSilent: no answer.
            Rejected: it refuses a step.
            LinkLost: the adapter is gone.
        """
        self._registers.write(self._servo, "bus_watchdog", 0)
        if self._held:
            self.go_to(self.sense().pulse)
        else:
            for error in disable_torque(self._registers, [self._servo]).values():
                raise error
        for name, value in self._before.items():
            self._registers.write(self._servo, name, value)
