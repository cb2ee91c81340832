"""Name the registers that the firmware's loops use, as arrays over all servos of a bus."""

from typing import Final

import numpy as np
from numpy.typing import DTypeLike, NDArray

from drivers.dynamixel.tables.control_table import MODELS, Register
from sim_twin.servos.protocol.register_file import RegisterFile

IntColumn = NDArray[np.int32]

_DTYPES: Final[dict[tuple[int, bool], DTypeLike]] = {
    (1, False): "<u1",
    (1, True): "<i1",
    (2, False): "<u2",
    (2, True): "<i2",
    (4, False): "<u4",
    (4, True): "<i4",
}


def _all_registers() -> dict[str, Register]:
    """Merge the models' tables; a register sits at the same address wherever it exists."""
    merged: dict[str, Register] = {}
    for model in MODELS.values():
        merged |= model.registers
    return merged


_REGISTERS: Final = _all_registers()


class TableColumns:
    """Give writable arrays that share the memory of the control tables.

    Where a model lacks the register its entry is spare memory, which reads as zero.
    """

    def __init__(self, registers: RegisterFile) -> None:
        self._file = registers
        self.drive_mode = self.named("drive_mode")
        self.operating_mode = self.named("operating_mode")
        self.homing_offset = self.named("homing_offset")
        self.pwm_limit = self.named("pwm_limit")
        self.current_limit = self.named("current_limit")
        self.velocity_limit = self.named("velocity_limit")
        self.shutdown = self.named("shutdown")
        self.torque_enable = self.named("torque_enable")
        self.status_return_level = self.named("status_return_level")
        self.hardware_error = self.named("hardware_error_status")
        self.velocity_i_gain = self.named("velocity_i_gain")
        self.velocity_p_gain = self.named("velocity_p_gain")
        self.position_d_gain = self.named("position_d_gain")
        self.position_i_gain = self.named("position_i_gain")
        self.position_p_gain = self.named("position_p_gain")
        self.feedforward_1st_gain = self.named("feedforward_1st_gain")
        self.feedforward_2nd_gain = self.named("feedforward_2nd_gain")
        self.bus_watchdog = self.named("bus_watchdog")
        self.goal_pwm = self.named("goal_pwm")
        self.goal_current = self.named("goal_current")
        self.goal_velocity = self.named("goal_velocity")
        self.profile_acceleration = self.named("profile_acceleration")
        self.profile_velocity = self.named("profile_velocity")
        self.goal_position = self.named("goal_position")

    def named(self, name: str) -> IntColumn:
        """Return the column of any register of the series."""
        register = _REGISTERS[name]
        return self._file.column(register.address, _DTYPES[register.size, register.signed])
