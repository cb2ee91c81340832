"""Time the calibrations of an ODrive axis: the steps that each takes, and how long they last."""

from collections.abc import Mapping
from typing import Final

from drivers.clock import NS_PER_S
from drivers.odrive.codec import AxisState

# Firmware 0.5 (axis.cpp, motor.cpp, encoder.cpp), whose source is public: 3000 ms for the phase
# resistance and 1250 ms for the inductance; 1 s of lock, then 16 pi rad at 4 pi rad/s both ways.
_MOTOR_S: Final = 3.0 + 1.25
_SCAN_S: Final = 1.0 + 2 * 4.0
_SEARCH_S: Final = 2.0  # chosen: until an index or a direction is found
_STEPS_S: Final[Mapping[AxisState, float]] = {
    AxisState.MOTOR_CALIBRATION: _MOTOR_S,
    AxisState.ENCODER_INDEX_SEARCH: _SEARCH_S,
    AxisState.ENCODER_OFFSET_CALIBRATION: _SCAN_S,
    AxisState.ENCODER_DIR_FIND: _SEARCH_S,
    AxisState.ENCODER_HALL_POLARITY_CALIBRATION: _SCAN_S,
    AxisState.ENCODER_HALL_PHASE_CALIBRATION: _SCAN_S,
}
CALIBRATIONS: Final[Mapping[int, tuple[AxisState, ...]]] = {
    AxisState.FULL_CALIBRATION_SEQUENCE: (
        AxisState.MOTOR_CALIBRATION,
        AxisState.ENCODER_OFFSET_CALIBRATION,
    ),
    **{state: (state,) for state in _STEPS_S},
}
"""What Set_Axis_State may ask for, with the states that the heartbeat then shows, in order."""


class AxisCalibration:
    """Follow one calibration; the emulated motor and encoder need none, so each succeeds."""

    def __init__(self, wanted: AxisState, start_ns: int) -> None:
        self._steps = CALIBRATIONS[wanted]
        self._start_ns = start_ns

    def state(self, now_ns: int) -> AxisState:
        """Return the state to show at `now_ns`; idle when all steps are done."""
        end_ns = self._start_ns
        for step in self._steps:
            end_ns += round(_STEPS_S[step] * NS_PER_S)
            if now_ns < end_ns:
                return step
        return AxisState.IDLE
