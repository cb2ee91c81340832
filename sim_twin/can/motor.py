"""Emulate the CiA 402 part of a wheel drive: power state, ramps, velocity loop, encoder."""

import math
from collections.abc import Callable
from typing import Final

from drivers.canopen.cia402 import PowerState
from drivers.canopen.objects import (
    ABORT_CONNECTION_OPTION,
    CONTROLWORD,
    ENCODER_RESOLUTION,
    FAULT_REACTION_OPTION,
    MODE_DISPLAY,
    MODE_OF_OPERATION,
    POSITION_ACTUAL,
    PROFILE_ACCELERATION,
    PROFILE_DECELERATION,
    QUICK_STOP_DECELERATION,
    QUICK_STOP_OPTION,
    RATED_TORQUE,
    RATED_TORQUE_PER_NM,
    STATUSWORD,
    TARGET_VELOCITY,
    TORQUE_ACTUAL,
    TORQUE_STEPS_PER_RATED,
    VELOCITY_ACTUAL,
    VELOCITY_DEMAND,
    VELOCITY_THRESHOLD,
    VELOCITY_WINDOW,
    AbortConnection,
    OperatingMode,
)
from sim_twin.can.object_dictionary import VALUE_RANGE, ObjectDictionary, SdoAbort
from sim_twin.can.power_state_machine import RAMP_OPTIONS, STATE_BITS, PowerStateMachine
from sim_twin.can.velocity_loop import VelocityLoop, ramp_towards

HALT_BIT: Final = 0x0100
FAULT_REACTION_OPTIONS: Final = (0, 1, 2)
_REMOTE, _TARGET_REACHED, _LIMIT_ACTIVE, _SPEED_ZERO = (1 << bit for bit in (9, 10, 11, 12))


class Motor:
    """Turn controlwords and a velocity target into torque; all values are on the motor's side."""

    def __init__(
        self, objects: ObjectDictionary, loop: VelocityLoop, *, counts_per_rev: int, rated_nm: float
    ) -> None:
        self._objects = objects
        self._loop = loop
        self._counts_per_rev = counts_per_rev
        self._counts_per_rad = counts_per_rev / math.tau
        self._rated_nm = rated_nm
        self._machine = PowerStateMachine()
        self._zero_rad: float | None = None
        self._position_rad = 0.0
        self._velocity_rad_s = 0.0
        self._demand_rad_s = 0.0
        self._torque_nm = 0.0
        self.remote = False
        self._publish()

    def _publish(self) -> None:
        self._objects.live.update(
            {
                (STATUSWORD, 0): self.statusword,
                (MODE_DISPLAY, 0): lambda: self._objects.get(MODE_OF_OPERATION),
                (POSITION_ACTUAL, 0): lambda: self.position_counts,
                (VELOCITY_ACTUAL, 0): lambda: self.velocity_counts_s,
                (VELOCITY_DEMAND, 0): lambda: round(self._demand_rad_s * self._counts_per_rad),
                (TORQUE_ACTUAL, 0): lambda: self.torque_steps,
            }
        )
        self._objects.on_write.update(
            {
                (CONTROLWORD, 0): self.on_controlword,
                (MODE_OF_OPERATION, 0): _one_of(tuple(OperatingMode)),
                (QUICK_STOP_OPTION, 0): _one_of(RAMP_OPTIONS),
                (FAULT_REACTION_OPTION, 0): _one_of(FAULT_REACTION_OPTIONS),
            }
        )

    @property
    def state(self) -> PowerState:
        """Return the power state."""
        return self._machine.state

    @property
    def position_counts(self) -> int:
        """Return the encoder's 32-bit counter; it starts at 0 with the supply."""
        travelled_rad = self._position_rad - (self._zero_rad or 0.0)
        counts = round(travelled_rad * self._counts_per_rad)
        return (counts + 0x8000_0000) % 0x1_0000_0000 - 0x8000_0000

    @property
    def velocity_counts_s(self) -> int:
        """Return the measured velocity in whole counts per second."""
        return round(self._velocity_rad_s * self._counts_per_rad)

    @property
    def torque_steps(self) -> int:
        """Return the torque in thousandths of the rated torque."""
        return round(self._torque_nm / self._rated_nm * TORQUE_STEPS_PER_RATED)

    def statusword(self) -> int:
        """Return the statusword (6041)."""
        at_target = abs(self.velocity_counts_s - self._target_counts_s()) <= self._objects.get(
            VELOCITY_WINDOW
        )
        return (
            STATE_BITS[self.state]
            | _REMOTE * self.remote
            | _TARGET_REACHED * at_target
            | _LIMIT_ACTIVE * self._loop.saturated
            | _SPEED_ZERO * self._stands()
        )

    def start(self) -> None:
        """Boot the firmware: power off, everything at its default."""
        self._objects.set(ENCODER_RESOLUTION, 1, self._counts_per_rev)
        self._objects.set(RATED_TORQUE, 0, round(self._rated_nm * RATED_TORQUE_PER_NM))
        self._machine.initialise()

    def lose_supply(self) -> None:
        """Forget the encoder's count and produce no torque."""
        self._zero_rad = None
        self._torque_nm = 0.0

    def on_controlword(self, controlword: int) -> bool:
        """Follow a new controlword; tell whether it took back a fault."""
        self._objects.set(CONTROLWORD, 0, controlword)
        return self._machine.command(controlword, self._objects.get(QUICK_STOP_OPTION))

    def fail(self) -> None:
        """React to a fault as 605E says."""
        if self.state not in (PowerState.FAULT, PowerState.FAULT_REACTION_ACTIVE):
            self._machine.fail(self._objects.get(FAULT_REACTION_OPTION))

    def on_connection_lost(self) -> None:
        """React to a lost master as 6007 says."""
        match self._objects.get(ABORT_CONNECTION_OPTION):
            case AbortConnection.FAULT:
                self.fail()
            case AbortConnection.DISABLE_VOLTAGE:
                self._machine.disable()
            case AbortConnection.QUICK_STOP:
                self._machine.quick_stop(self._objects.get(QUICK_STOP_OPTION))

    def advance(self, dt_s: float, position_rad: float, velocity_rad_s: float) -> float:
        """Measure, move the demand along its ramp and return the torque."""
        if self._zero_rad is None:
            self._zero_rad = position_rad
        self._position_rad = position_rad
        self._velocity_rad_s = velocity_rad_s
        if not self._machine.powered:
            self._demand_rad_s = velocity_rad_s
            self._loop.reset()
            self._torque_nm = 0.0
            return 0.0
        self._demand_rad_s = self._next_demand(dt_s)
        self._torque_nm = self._loop.torque_nm(self._demand_rad_s, velocity_rad_s, dt_s)
        if self._demand_rad_s == 0.0 and self._stands():
            self._machine.at_standstill(self._objects.get(QUICK_STOP_OPTION))
        return self._torque_nm

    def _next_demand(self, dt_s: float) -> float:
        if self.state is not PowerState.OPERATION_ENABLED:
            return self._braked(QUICK_STOP_DECELERATION, dt_s)
        if self._objects.get(CONTROLWORD) & HALT_BIT:
            return self._braked(PROFILE_DECELERATION, dt_s)
        target_rad_s = self._target_counts_s() / self._counts_per_rad
        if self._objects.get(MODE_OF_OPERATION) == OperatingMode.CYCLIC_SYNCHRONOUS_VELOCITY:
            return target_rad_s
        up, down = self._step(PROFILE_ACCELERATION, dt_s), self._step(PROFILE_DECELERATION, dt_s)
        return ramp_towards(self._demand_rad_s, target_rad_s, up, down)

    def _braked(self, deceleration: int, dt_s: float) -> float:
        step = self._step(deceleration, dt_s)
        return ramp_towards(self._demand_rad_s, 0.0, step, step)

    def _step(self, ramp: int, dt_s: float) -> float:
        return self._objects.get(ramp) / self._counts_per_rad * dt_s

    def _target_counts_s(self) -> int:
        return self._objects.get(TARGET_VELOCITY)

    def _stands(self) -> bool:
        return abs(self.velocity_counts_s) <= self._objects.get(VELOCITY_THRESHOLD)


def _one_of(allowed: tuple[int, ...]) -> Callable[[int], None]:
    def check(value: int) -> None:
        if value not in allowed:
            raise SdoAbort(VALUE_RANGE)

    return check
