"""Gather what the safety judge sees each tick."""

from math import isfinite
from typing import Any

import numpy as np

from drivers.clock import NS_PER_S, Clock
from vla_deploy.control.motion.axes import Floats, any_of
from vla_deploy.control.motion.base_velocity import STANDING, BaseVelocity
from vla_deploy.control.output.base_drive import BaseDrive
from vla_deploy.control.output.joint_steps import JointSteps
from vla_deploy.control.output.servos import ServoLine
from vla_deploy.ipc import CellReader, Sample, SharedSpace, topics
from vla_deploy.ipc.payloads.supervision import BudgetStop
from vla_deploy.safety import SafetyInputs, Surroundings

_DATED = (topics.REMOTE_BASE_COMMAND, topics.HAND_BASE_COMMAND)
"""Wishes that say how long they hold."""
BASE_COMMANDS = (topics.BASE_COMMAND, *_DATED)
_DATED_NAMES = frozenset(one.name for one in _DATED)
_OVER_S = 1.0
_NO_REASON = "a budget is exhausted"


class InputCollector:
    """Read the cells that control depends on, and put a tick's measurements together."""

    def __init__(
        self, space: SharedSpace, servos: ServoLine, wheels: BaseDrive, clock: Clock
    ) -> None:
        self.wanted = STANDING
        """What the newest command asks of the base."""
        self._base_commands = tuple(map(space.cell_reader, BASE_COMMANDS))
        self._process_table = space.cell_reader(topics.PROCESS_TABLE)
        self._budget = BudgetWatch(space.cell_reader(topics.BUDGET_STOP))
        self._servos = servos
        self._wheels = wheels
        self._clock = clock
        self._base_taken = ("", 0)
        self._base_age_s: float | None = None
        self._quiet = np.zeros(len(servos.state.torque_on), dtype=np.bool_)
        self._powered = self._quiet.copy()
        self._steps = JointSteps(len(self._quiet))

    def refresh(self) -> None:
        """Take in the newest base command and what the joints have told."""
        self._steps.take(self._servos.state)
        if not self._wheels.has_wheels:
            return
        sample = self._newest_base_command()
        if sample is None:
            return
        self._base_age_s = _age_s(sample, self._clock.now_ns())
        if (sample.topic, sample.sequence) != self._base_taken:
            self._base_taken = (sample.topic, sample.sequence)
            wanted = BaseVelocity(*(float(sample.data[name]) for name in BaseVelocity._fields))
            self.wanted = wanted if all(map(isfinite, wanted)) else STANDING

    def inputs(
        self,
        *,
        energised: bool,
        stop_latched: bool,
        estop_source: str | None,
        reset_requested: bool,
        setpoint: Floats,
        base_at_rest: bool,
        standstill: bool,
        surroundings: Surroundings,
    ) -> SafetyInputs:
        """Return the tick's measurements.

        Tripped watchdogs do not hold up a reset: the servos go on holding until arming clears
        them. What arming clears by itself, and a stale command, is judged only while energised.
        What loses its power while a stop is latched has not let go: the stop may take it.
        """
        state = self._servos.state
        powers = energised and not stop_latched
        self._powered = self._powered | state.torque_on if powers else self._quiet
        guarded = energised and not reset_requested
        commanded = not base_at_rest or self.wanted != STANDING
        return SafetyInputs(
            energised=energised,
            estop_source=estop_source,
            reset_requested=reset_requested,
            position=state.position_rad,
            velocity=state.velocity_rad_s,
            position_step=self._steps.step,
            step_time_s=self._steps.time_s,
            setpoint=setpoint,
            powered=self._powered,
            torque_enabled=state.torque_on,
            sample_age_s=state.age_s,
            effort_ratio=state.effort_ratio,
            temperature_c=state.temperature_c,
            voltage_v=state.voltage_v,
            climate_age_s=self._climate_age_s(),
            hardware_error=state.error,
            watchdog_tripped=self._servos.watchdog_tripped if guarded else self._quiet,
            lost_servo_buses=self._servos.lost_parts,
            lost_can_buses=(self._wheels.name,) if self._wheels.lost else (),
            drives=self._wheels.samples() if energised else (),
            base_moving=energised and commanded,
            base_powered=self._wheels.enabled,
            standstill=standstill,
            base_command_age_s=self._base_age_s,
            supervisor_age_s=self._age_s(self._process_table),
            budget_stop=self._budget.reason(),
            surroundings=surroundings,
        )

    def _newest_base_command(self) -> Sample | None:
        """Return the youngest wish: who moves the base holds its claim, and goes on telling."""
        newest = None
        for command in self._base_commands:
            sample = command.latest()
            if sample is not None and (newest is None or sample.stamp_ns > newest.stamp_ns):
                newest = sample
        return newest

    def _climate_age_s(self) -> Floats:
        """Return how old voltage and temperature are: polled servos tell them now and then."""
        state = self._servos.state
        polled = state.climate_stamp_ns >= 0
        if not any_of(polled):
            return state.age_s
        age_s = (self._clock.now_ns() - state.climate_stamp_ns) / NS_PER_S
        return np.where(polled, age_s, state.age_s)

    def _age_s(self, cell: CellReader[Any]) -> float | None:
        sample = cell.latest()
        return None if sample is None else sample.age_s(self._clock.now_ns())

    def close(self) -> None:
        """Unmap the topics."""
        for command in self._base_commands:
            command.close()
        self._process_table.close()
        self._budget.close()


def _age_s(command: Sample, now_ns: int) -> float:
    """Return how old a wish is; one that has outlived what it says of itself is too old."""
    age_s = command.age_s(now_ns)
    is_over = command.topic in _DATED_NAMES and age_s > float(command.data["valid_s"])
    return max(age_s, _OVER_S) if is_over else age_s


class BudgetWatch:
    """Read whether the supervisor's budgets demand a protective stop, and which."""

    def __init__(self, cell: CellReader[BudgetStop]) -> None:
        self._cell = cell
        self._sequence = 0
        self._reason: str | None = None

    def reason(self) -> str | None:
        """Return the demand as it was told last, in words, or None; silence does not end it."""
        sample = self._cell.latest()
        if sample is not None and sample.sequence != self._sequence:
            self._sequence = sample.sequence
            told = sample.document()
            self._reason = str(told.get("reason") or _NO_REASON) if told.get("stop") else None
        return self._reason

    def close(self) -> None:
        """Unmap the topic."""
        self._cell.close()
