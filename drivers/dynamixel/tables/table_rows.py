"""List the registers of the X series; a model differs from them only as `models` says.

Source: ROBOTIS e-manual, control tables of the X series. Indirect slots are not listed one by one.
"""

from typing import Final

from drivers.dynamixel.tables.model import PWM_FULL, WATCHDOG_MAX, IndirectBank, Register

# fmt: off
#     name, address, size, access, eeprom, signed, initial, minimum, maximum
COMMON: Final = (
    Register("model_number", 0, 2, "r", True, False, None, None, None),
    Register("model_information", 2, 4, "r", True, False, 0, None, None),
    Register("firmware_version", 6, 1, "r", True, False, None, None, None),
    Register("id", 7, 1, "rw", True, False, 1, 0, 252),
    Register("baud_rate", 8, 1, "rw", True, False, 1, 0, 7),
    Register("return_delay_time", 9, 1, "rw", True, False, 250, 0, 254),
    Register("drive_mode", 10, 1, "rw", True, False, 0, 0, 13),
    Register("operating_mode", 11, 1, "rw", True, False, 3, 0, 16),
    Register("secondary_id", 12, 1, "rw", True, False, 255, 0, 255),
    Register("protocol_type", 13, 1, "rw", True, False, 2, 1, 2),
    Register("homing_offset", 20, 4, "rw", True, True, 0, -1_044_479, 1_044_479),
    Register("moving_threshold", 24, 4, "rw", True, False, 10, 0, 1023),
    Register("temperature_limit", 31, 1, "rw", True, False, 80, 0, 100),
    Register("max_voltage_limit", 32, 2, "rw", True, False, 160, 95, 160),
    Register("min_voltage_limit", 34, 2, "rw", True, False, 95, 95, 160),
    Register("pwm_limit", 36, 2, "rw", True, False, PWM_FULL, 0, PWM_FULL),
    Register("velocity_limit", 44, 4, "rw", True, False, 200, 0, 1023),
    Register("max_position_limit", 48, 4, "rw", True, False, 4095, 0, 4095),
    Register("min_position_limit", 52, 4, "rw", True, False, 0, 0, 4095),
    Register("startup_configuration", 60, 1, "rw", True, False, 0, 0, 3),
    Register("shutdown", 63, 1, "rw", True, False, 52, 0, 61),
    Register("torque_enable", 64, 1, "rw", False, False, 0, 0, 1),
    Register("led", 65, 1, "rw", False, False, 0, 0, 1),
    Register("status_return_level", 68, 1, "rw", False, False, 2, 0, 2),
    Register("registered_instruction", 69, 1, "r", False, False, 0, None, None),
    Register("hardware_error_status", 70, 1, "r", False, False, 0, None, None),
    Register("velocity_i_gain", 76, 2, "rw", False, False, 1920, 0, 16_383),
    Register("velocity_p_gain", 78, 2, "rw", False, False, 100, 0, 16_383),
    Register("position_d_gain", 80, 2, "rw", False, False, 0, 0, 16_383),
    Register("position_i_gain", 82, 2, "rw", False, False, 0, 0, 16_383),
    Register("position_p_gain", 84, 2, "rw", False, False, 800, 0, 16_383),
    Register("feedforward_2nd_gain", 88, 2, "rw", False, False, 0, 0, 16_383),
    Register("feedforward_1st_gain", 90, 2, "rw", False, False, 0, 0, 16_383),
    Register("bus_watchdog", 98, 1, "rw", False, True, 0, 0, WATCHDOG_MAX),
    Register("goal_pwm", 100, 2, "rw", False, True, PWM_FULL, -PWM_FULL, PWM_FULL),
    Register("goal_velocity", 104, 4, "rw", False, True, 0, -1023, 1023),
    Register("profile_acceleration", 108, 4, "rw", False, False, 0, 0, 32_767),
    Register("profile_velocity", 112, 4, "rw", False, False, 0, 0, 32_767),
    Register("goal_position", 116, 4, "rw", False, True, None, -1_048_575, 1_048_575),
    Register("realtime_tick", 120, 2, "r", False, False, 0, None, None),
    Register("moving", 122, 1, "r", False, False, 0, None, None),
    Register("moving_status", 123, 1, "r", False, False, 0, None, None),
    Register("present_pwm", 124, 2, "r", False, True, 0, None, None),
    Register("present_velocity", 128, 4, "r", False, True, 0, None, None),
    Register("present_position", 132, 4, "r", False, True, None, None, None),
    Register("velocity_trajectory", 136, 4, "r", False, True, 0, None, None),
    Register("position_trajectory", 140, 4, "r", False, True, None, None, None),
    Register("present_input_voltage", 144, 2, "r", False, False, 120, None, None),
    Register("present_temperature", 146, 1, "r", False, False, 25, None, None),
    Register("backup_ready", 147, 1, "r", False, False, 0, None, None),
)
LOAD_SENSING: Final = (
    Register("present_load", 126, 2, "r", False, True, 0, -1000, 1000),
)
CURRENT_SENSING: Final = (
    Register("current_limit", 38, 2, "rw", True, False, 1193, 0, 1193),
    Register("goal_current", 102, 2, "rw", False, True, 1193, -1193, 1193),
    Register("present_current", 126, 2, "r", False, True, 0, None, None),
)
PWM_SLOPE: Final = (
    Register("pwm_slope", 62, 1, "rw", True, False, 140, 1, 255),
)
EXTERNAL_PORTS: Final = (
    Register("external_port_mode_1", 56, 1, "rw", True, False, 3, 0, 3),
    Register("external_port_mode_2", 57, 1, "rw", True, False, 3, 0, 3),
    Register("external_port_mode_3", 58, 1, "rw", True, False, 3, 0, 3),
    Register("external_port_data_1", 152, 2, "rw", False, False, None, 0, 4095),
    Register("external_port_data_2", 154, 2, "rw", False, False, None, 0, 4095),
    Register("external_port_data_3", 156, 2, "rw", False, False, None, 0, 4095),
)
# fmt: on

# X430 and X540
LARGE_INDIRECT: Final = ((1, (IndirectBank(168, 224, 28), IndirectBank(578, 634, 28))),)
# X330; the move of the data with firmware 53 is told by the vendor's model files
SMALL_INDIRECT: Final = ((53, (IndirectBank(168, 224, 28),)), (1, (IndirectBank(168, 208, 20),)))
