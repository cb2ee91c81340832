"""Emulate the CiA 402 part of a wheel drive: power state, ramps, velocity loop, objects."""

from collections.abc import Callable
from typing import Final

from drivers.canopen.cia402 import FAULT_STATES
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
    DriveMode,
)
from drivers.wheel_drives.bus import PowerState
from sim_twin.can.cia402.object_dictionary import VALUE_RANGE, ObjectDictionary, SdoAbort
from sim_twin.can.cia402.power_state_machine import (
    POWERED,
    RAMP_OPTIONS,
    STATE_BITS,
    PowerStateMachine,
)
from sim_twin.can.cia402.velocity_loop import VelocityLoop, ramp_towards
from sim_twin.can.power_stage import PowerStage, ShaftEncoder

HALT_BIT: Final = 0x0100
FAULT_REACTION_OPTIONS: Final = (0, 1, 2)
# Which ramp an option brakes on: 1 and 5 slow down as the profile does, 2 and 6 stop quickly.
FAULT_RAMPS: Final = {1: PROFILE_DECELERATION, 2: QUICK_STOP_DECELERATION}
QUICK_STOP_RAMPS: Final = {
    1: PROFILE_DECELERATION,
    2: QUICK_STOP_DECELERATION,
    5: PROFILE_DECELERATION,
    6: QUICK_STOP_DECELERATION,
}
ARMED: Final = (
    PowerState.SWITCHED_ON,
    PowerState.OPERATION_ENABLED,
    PowerState.QUICK_STOP_ACTIVE,
)
# Bound here because every step asks for them.
_CYCLIC: Final = int(DriveMode.CYCLIC_SYNCHRONOUS_VELOCITY)
_ENABLED: Final = PowerState.OPERATION_ENABLED
_CONTROLWORD, _TARGET, _MODE = (CONTROLWORD, 0), (TARGET_VELOCITY, 0), (MODE_OF_OPERATION, 0)
_ACCELERATION, _DECELERATION = (PROFILE_ACCELERATION, 0), (PROFILE_DECELERATION, 0)
RATED_CURRENT: Final = 0x6075
CURRENT_ACTUAL: Final = 0x6078
DC_LINK_VOLTAGE: Final = 0x6079
MOTOR_TEMPERATURE: Final = 0x2001
MILLI: Final = 1000
_REMOTE, _TARGET_REACHED, _LIMIT_ACTIVE, _SPEED_ZERO = (1 << bit for bit in (9, 10, 11, 12))


class Cia402Axis:
    """Turn controlwords and a velocity target into torque; all values are on the motor's side."""

    def __init__(
        self,
        objects: ObjectDictionary,
        loop: VelocityLoop,
        stage: PowerStage,
        encoder: ShaftEncoder,
    ) -> None:
        self._objects = objects
        self._loop = loop
        self._stage = stage
        self._encoder = encoder
        self._rated_nm = stage.spec.torque_limit_nm
        self._machine = PowerStateMachine()
        self._velocity_rad_s = 0.0
        self._demand_rad_s = 0.0
        self._torque_nm = 0.0
        self._told_nm = 0.0
        self.remote = False
        self._publish()

    def _publish(self) -> None:
        self._objects.live.update(
            {
                (STATUSWORD, 0): self.statusword,
                (MODE_DISPLAY, 0): lambda: self._objects.get(MODE_OF_OPERATION),
                (POSITION_ACTUAL, 0): lambda: self.position_counts,
                (VELOCITY_ACTUAL, 0): lambda: self.velocity_counts_s,
                (VELOCITY_DEMAND, 0): lambda: round(
                    self._demand_rad_s * self._encoder.counts_per_rad
                ),
                (TORQUE_ACTUAL, 0): lambda: self.torque_steps,
                (CURRENT_ACTUAL, 0): lambda: self.torque_steps,  # the torque constant is constant
                (DC_LINK_VOLTAGE, 0): lambda: round(self._stage.bus_v * MILLI),
                (MOTOR_TEMPERATURE, 0): lambda: round(self._stage.temperature_c),
            }
        )
        self._objects.on_write.update(
            {
                (CONTROLWORD, 0): self.on_controlword,
                (MODE_OF_OPERATION, 0): _one_of(tuple(DriveMode)),
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
        return (self._encoder.travelled + 0x8000_0000) % 0x1_0000_0000 - 0x8000_0000

    @property
    def velocity_counts_s(self) -> int:
        """Return the measured velocity in whole counts per second."""
        return round(self._encoder.counts_s)

    @property
    def torque_steps(self) -> int:
        """Return the torque in thousandths of the rated torque."""
        if not self._encoder.frozen:
            self._told_nm = self._torque_nm
        return round(self._told_nm / self._rated_nm * TORQUE_STEPS_PER_RATED)

    def statusword(self) -> int:
        """Return the statusword (6041)."""
        values = self._objects.values
        error_counts_s = self._encoder.counts_s - values[TARGET_VELOCITY, 0]
        at_target: bool = abs(error_counts_s) <= values[VELOCITY_WINDOW, 0]
        return (
            STATE_BITS[self.state]
            | _REMOTE * self.remote
            | _TARGET_REACHED * at_target
            | _LIMIT_ACTIVE * self._loop.saturated
            | _SPEED_ZERO * self._stands()
        )

    def start(self) -> None:
        """Boot the firmware: power off, everything at its default."""
        self._objects.set(ENCODER_RESOLUTION, 1, self._encoder.counts_per_rev)
        self._objects.set(RATED_TORQUE, 0, round(self._rated_nm * RATED_TORQUE_PER_NM))
        rated_a = self._stage.spec.current_limit_a
        self._objects.set(RATED_CURRENT, 0, round(rated_a * MILLI))
        self._stage.forget_load()
        self._machine.initialise()

    def lose_supply(self) -> None:
        """Produce no torque."""
        self._torque_nm = 0.0

    def on_controlword(self, controlword: int) -> bool:
        """Follow a new controlword; tell whether it took back a fault."""
        self._objects.set(CONTROLWORD, 0, controlword)
        return self._machine.command(controlword, self._objects.get(QUICK_STOP_OPTION))

    def fail(self) -> None:
        """React to a fault as 605E says."""
        if not self.faulted:
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

    @property
    def faulted(self) -> bool:
        """Return whether the drive is in one of its fault states."""
        return self.state in FAULT_STATES

    @property
    def armed(self) -> bool:
        """Return whether the power stage is switched on."""
        return self.state in ARMED

    def advance(self, dt_s: float, velocity_rad_s: float) -> float:
        """Move the demand along its ramp and return the torque."""
        self._velocity_rad_s = velocity_rad_s
        state = self._machine.state
        if state is not _ENABLED and state not in POWERED:
            self._demand_rad_s = velocity_rad_s
            self._loop.reset()
            self._torque_nm = 0.0
            return 0.0
        self._demand_rad_s = demand_rad_s = self._next_demand(state, dt_s)
        low_nm, high_nm = self._stage.torque_range_nm(velocity_rad_s)
        error_rad_s = demand_rad_s - velocity_rad_s
        self._torque_nm = torque_nm = self._loop.torque_nm(error_rad_s, dt_s, low_nm, high_nm)
        if demand_rad_s == 0.0 and state is not _ENABLED and self._stands():
            self._machine.at_standstill(self._objects.get(QUICK_STOP_OPTION))
        return torque_nm

    def _next_demand(self, state: PowerState, dt_s: float) -> float:
        values = self._objects.values
        if state is not _ENABLED or values[_CONTROLWORD] & HALT_BIT:
            return self._braked(self._braking_ramp(), dt_s)
        counts_per_rad = self._encoder.counts_per_rad
        target_rad_s: float = values[_TARGET] / counts_per_rad
        if values[_MODE] == _CYCLIC or target_rad_s == self._demand_rad_s:
            return target_rad_s
        step_s = dt_s / counts_per_rad
        up, down = values[_ACCELERATION] * step_s, values[_DECELERATION] * step_s
        return ramp_towards(self._demand_rad_s, target_rad_s, up, down)

    def _braking_ramp(self) -> int:
        objects, state = self._objects, self._machine.state
        if state is PowerState.FAULT_REACTION_ACTIVE:
            return FAULT_RAMPS.get(objects.get(FAULT_REACTION_OPTION), QUICK_STOP_DECELERATION)
        if state is PowerState.QUICK_STOP_ACTIVE:
            return QUICK_STOP_RAMPS.get(objects.get(QUICK_STOP_OPTION), QUICK_STOP_DECELERATION)
        return PROFILE_DECELERATION

    def _braked(self, deceleration: int, dt_s: float) -> float:
        step = self._objects.get(deceleration) / self._encoder.counts_per_rad * dt_s
        return ramp_towards(self._demand_rad_s, 0.0, step, step)

    def _stands(self) -> bool:
        # The control loop measures finer than the counts of a few steps tell.
        counts_s = self._velocity_rad_s * self._encoder.counts_per_rad
        return abs(counts_s) <= int(self._objects.values[VELOCITY_THRESHOLD, 0])


def _one_of(allowed: tuple[int, ...]) -> Callable[[int], None]:
    def check(value: int) -> None:
        if value not in allowed:
            raise SdoAbort(VALUE_RANGE)

    return check
