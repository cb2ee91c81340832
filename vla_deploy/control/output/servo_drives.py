"""Drive wheels by servos of the servo bus, as other wheels are by drives of a CAN bus."""

import logging
import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from drivers.clock import NS_PER_S, Clock
from drivers.errors import LinkLost, NoReply
from drivers.servo.state import SILENT_S, hardware_error_text
from drivers.stepping import wait_for
from drivers.wheel_drives.bus import DriveFault, DriveGoal, DriveState, PowerState, ResetRule
from vla_deploy.control.output.servos import ServoLine

_LOG = logging.getLogger(__name__)
_SILENCE_NS: Final = NS_PER_S
_STANDING_RAD_S: Final = 0.1


@dataclass(frozen=True, slots=True)
class WheelServoFault:
    """Hold the hardware error of a wheel's servo; the operator's reset reboots it."""

    code: int

    @property
    def text(self) -> str:
        """Return it in words."""
        return hardware_error_text(self.code)

    @property
    def rule(self) -> ResetRule:
        """Return who may take it back."""
        return ResetRule.OPERATOR


class ServoDrives:
    """Keep the contract of a bus of wheel drives by servos in velocity mode.

    The line's own read in each tick brings their state, and its reopening brings them back at
    rest. **They do not stop by themselves when the calls of `cycle` stop**, which the contract
    asks for: servos without a bus watchdog go on turning (docs/safety.md).
    """

    def __init__(self, line: ServoLine, clock: Clock) -> None:
        self._line = line
        self._clock = clock
        count = len(line.wheel_rows)
        self._goal = DriveGoal.DISABLED
        self._standing = np.zeros(count)
        self._turned_rad = np.zeros(count)
        self._seen_rad: list[float] | None = None
        self._waking: list[int] = []

    @property
    def enabled(self) -> bool:
        """Return whether all wheels follow their speeds."""
        wheels = self._line.wheels
        return (
            self._goal is DriveGoal.ENABLED
            and not self._line.lost
            and bool(wheels.torque_on.all())
            and not wheels.error.any()
        )

    @property
    def counters(self) -> None:
        """Return that these servos have no bus of their own: the line counts for all of it."""
        return None

    @property
    def notes(self) -> tuple[str, ...]:
        """Return nothing: what these servos cannot do is the same for all."""
        return ()

    def connecting(self) -> Iterator[None]:
        """Wait for line and wheels, and take their power; they stand since the line was opened.

        Raises:
            NoReply: a wheel does not answer in time, or keeps its power.
        """
        line = self._line
        while line.lost:
            yield
        deadline_ns = self._clock.now_ns() + _SILENCE_NS
        while not bool((line.wheels.age_s <= SILENT_S).all()):
            if self._clock.now_ns() >= deadline_ns:
                raise NoReply(f"no answer from {', '.join(self._silent())}; check power and cable")
            yield
            if line.lost:
                raise NoReply(f"{line.name}: the servo bus is lost")
        line.write_speeds(self._standing)
        if not line.remove_power(line.wheel_rows):
            raise NoReply(line.failure)

    def connect(self) -> None:
        """Do all of `connecting`, waiting in between.

        Raises:
            DriverError: as `connecting` does.
        """
        wait_for(self.connecting(), self._clock)

    def cycle(self, velocity_rad_s: NDArray[np.float64] | None) -> DriveState:
        """Send speeds and return what the line has read of the wheels in this tick.

        Raises:
            LinkLost: the line has gone.
            ValueError: a speed is not finite.
        """
        line = self._line
        if line.lost:
            raise LinkLost(line.failure or f"{line.name}: the servo bus is lost")
        self._wake_next()
        line.write_speeds(
            self._standing if velocity_rad_s is None or not self.enabled else velocity_rad_s
        )
        state = self._state()
        if self._goal is DriveGoal.QUICK_STOP and self._stands(state):
            self.disable()
        return state

    def enable(self) -> None:
        """Begin to power the wheels, one in each cycle; each begins at rest."""
        self._goal = DriveGoal.ENABLED
        powered = self._line.wheels.torque_on
        self._waking = [
            row for row, on in zip(self._line.wheel_rows, powered, strict=True) if not on
        ]

    def disable(self) -> None:
        """Take the power off all wheels."""
        self._release(DriveGoal.DISABLED)

    def cut_power(self) -> None:
        """Take the power off all wheels at once.

        Raises:
            LinkLost: the line has gone.
        """
        self._release(DriveGoal.DISABLED)
        if self._line.lost:
            raise LinkLost(self._line.failure)

    def quick_stop(self) -> None:
        """Let all wheels brake by the acceleration that their servos were given, then let go."""
        self._goal = DriveGoal.QUICK_STOP
        self._waking = []

    def reset_fault(self) -> tuple[str, ...]:
        """Reboot the servos that report an error; they come back without power."""
        self._goal = DriveGoal.FAULT_RESET
        line = self._line
        faulted = [
            row for row, bits in zip(line.wheel_rows, line.wheels.error, strict=True) if bits
        ]
        return () if line.reboot(faulted) else (line.failure,)

    def close(self) -> None:
        """Let the wheels stand, without power; the line stays with its owner."""
        if not self._line.lost:
            self._line.write_speeds(self._standing)
        self._release(DriveGoal.DISABLED)

    def _release(self, goal: DriveGoal) -> None:
        self._goal = goal
        self._waking = []
        if not self._line.lost:
            self._line.write_speeds(self._standing)
            self._line.remove_power(self._line.wheel_rows)

    def _wake_next(self) -> None:
        """Power one wheel; one that refuses is tried again, as long as the base is to be driven."""
        if not self._waking:
            return
        row = self._waking.pop(0)
        if not self._line.energise(row):
            _LOG.warning("wheels: %s", self._line.failure)
            self._waking.append(row)

    def _silent(self) -> list[str]:
        ages_s = self._line.wheels.age_s
        return [
            name for name, age in zip(self._line.wheel_names, ages_s, strict=True) if age > SILENT_S
        ]

    def _state(self) -> DriveState:
        wheels = self._line.wheels
        bits = wheels.error.tolist()
        return DriveState(
            position_rad=self._unwound(wheels.position_rad.tolist()),
            velocity_rad_s=wheels.velocity_rad_s.copy(),
            torque_nm=np.full(len(bits), np.nan),
            age_s=wheels.age_s.copy(),
            power_state=tuple(
                PowerState.FAULT
                if error
                else PowerState.OPERATION_ENABLED
                if on
                else PowerState.SWITCH_ON_DISABLED
                for error, on in zip(bits, wheels.torque_on.tolist(), strict=True)
            ),
            lost=tuple((wheels.age_s > SILENT_S).tolist()),
            faulted=tuple(map(bool, bits)),
            fault=self._faults(bits),
            enabled=self.enabled,
        )

    @staticmethod
    def _faults(bits: list[int]) -> tuple[DriveFault | None, ...]:
        return tuple(WheelServoFault(one) if one else None for one in bits)

    def _unwound(self, angles_rad: list[float]) -> NDArray[np.float64]:
        """Add up what the wheels have turned: their encoders begin anew after each turn."""
        seen, self._seen_rad = self._seen_rad, angles_rad
        before = angles_rad if seen is None else seen
        for row, (now, then) in enumerate(zip(angles_rad, before, strict=True)):
            self._turned_rad[row] += math.remainder(now - then, math.tau)
        return self._turned_rad.copy()

    @staticmethod
    def _stands(state: DriveState) -> bool:
        return bool((np.abs(state.velocity_rad_s) < _STANDING_RAD_S).all())
