"""Bring the present-value registers up to date when, and only when, somebody reads them."""

from collections.abc import Callable
from functools import cache
from typing import Final

import numpy as np

from drivers.clock import NS_PER_S
from drivers.dynamixel.tables.control_table import VOLTAGE_UNIT_V, OperatingMode
from sim_twin.servos.firmware.columns import TableColumns
from sim_twin.servos.firmware.motion import ServoMotion
from sim_twin.servos.firmware.profile import PULSES_S_PER_UNIT, Floats
from sim_twin.servos.firmware.protection import ServoProtection

FIRST_ADDRESS: Final = 116
END_ADDRESS: Final = 148
_TICK_MODULO: Final = 32_768
_NS_PER_MS: Final = NS_PER_S // 1000
_IN_POSITION_PULSES: Final = 20
_IN_POSITION, _PROFILE_ONGOING, _FOLLOWING_ERROR = 0x01, 0x02, 0x08
_PROFILE_TYPE_SHIFT: Final = 4


EFFORT_CYCLES: Final = 4


class Feedback:
    """Write what the servos sense into their tables."""

    def __init__(
        self, columns: TableColumns, motion: ServoMotion, protection: ServoProtection
    ) -> None:
        self._columns = columns
        self._motion = motion
        self._protection = protection
        self._moving_threshold = columns.named("moving_threshold")
        self._tick = columns.named("realtime_tick")
        self._moving = columns.named("moving")
        self._moving_status = columns.named("moving_status")
        self._pwm = columns.named("present_pwm")
        self._effort = columns.named("present_current")
        self._velocity = columns.named("present_velocity")
        self._position = columns.named("present_position")
        self._velocity_trajectory = columns.named("velocity_trajectory")
        self._position_trajectory = columns.named("position_trajectory")
        self._voltage = columns.named("present_input_voltage")
        self._temperature = columns.named("present_temperature")
        self._efforts = np.zeros((EFFORT_CYCLES, len(self._tick)))
        self._effort_rows = tuple(self._efforts)
        self._newest_effort = 0
        self.supply_v: Floats = np.full(len(self._tick), 12.0)
        self.now_ns = 0
        self.booted_ns = np.zeros(len(self._tick), np.int64)
        self._writers: tuple[tuple[int, int, Callable[[], None]], ...] = (
            (120, 122, self._write_tick),
            (122, 124, self._write_moving),
            (124, 126, self._write_pwm),
            (126, 128, self._write_effort),
            (128, 132, self._write_velocity),
            (132, 136, self._write_position),
            (136, 144, self._write_trajectory),
            (144, 147, self._write_supply),
        )
        self._due = cache(self._find_due)

    def sense_effort(self, joint_effort: Floats) -> None:
        """Take in a control cycle's torque."""
        self._newest_effort = newest = (self._newest_effort + 1) % EFFORT_CYCLES
        self._effort_rows[newest][:] = joint_effort

    @property
    def joint_effort(self) -> Floats:
        """Return the mean torque of the last control cycles, as a shunt's RC and its ADC tell it.

        One cycle's would alias: duty switches from cycle to cycle in step with a host's reads.
        """
        total: Floats = np.add.reduce(self._efforts)
        total /= EFFORT_CYCLES
        return total

    def refresh(self, address: int, length: int) -> None:
        """Update the registers within a range that is about to be read."""
        if address < END_ADDRESS and address + length > FIRST_ADDRESS:
            for write in self._due(address, address + length):
                write()

    def _find_due(self, start: int, end: int) -> tuple[Callable[[], None], ...]:
        return tuple(write for low, high, write in self._writers if start < high and end > low)

    def _write_tick(self) -> None:
        self._tick[:] = (self.now_ns - self.booted_ns) // _NS_PER_MS % _TICK_MODULO

    def _write_moving(self) -> None:
        motion, columns = self._motion, self._columns
        self._moving[:] = np.abs(motion.present_velocity()) > self._moving_threshold
        profile_left = np.abs(columns.goal_position - motion.profile.position) >= 1.0
        lag = np.abs(motion.profile.position - motion.pulses) > _IN_POSITION_PULSES
        arrived = np.abs(columns.goal_position - motion.pulses) <= _IN_POSITION_PULSES
        kind = (columns.profile_velocity > 0) + 2 * (
            (columns.profile_velocity > 0) & (columns.profile_acceleration > 0)
        )
        status = (
            arrived * _IN_POSITION
            + profile_left * _PROFILE_ONGOING
            + lag * _FOLLOWING_ERROR
            + (kind << _PROFILE_TYPE_SHIFT)
        )
        self._moving_status[:] = np.where(motion.in_position_mode, status, 0)

    def _write_pwm(self) -> None:
        self._pwm[:] = np.rint(self._motion.pwm)

    def _write_effort(self) -> None:
        self._effort[:] = np.rint(self._motion.present_effort(self.joint_effort))

    def _write_velocity(self) -> None:
        self._velocity[:] = np.rint(self._motion.present_velocity())

    def _write_position(self) -> None:
        self._position[:] = self._motion.pulses

    def _write_trajectory(self) -> None:
        profile = self._motion.profile
        in_velocity_mode = self._columns.operating_mode == OperatingMode.VELOCITY
        asked = np.where(
            in_velocity_mode, self._motion.ramped_velocity, profile.velocity / PULSES_S_PER_UNIT
        )
        self._velocity_trajectory[:] = np.rint(asked)
        self._position_trajectory[:] = np.rint(profile.position)

    def _write_supply(self) -> None:
        self._voltage[:] = np.rint(self.supply_v / VOLTAGE_UNIT_V)
        self._temperature[:] = np.rint(self._protection.thermals.body_c)
