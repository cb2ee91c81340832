"""Put what the wheel drives tell into the words of the safety judge."""

from collections.abc import Sequence
from typing import Final

from drivers.wheel_drives.bus import DriveState, PowerState
from vla_deploy.control.output.wheel_tracking import WheelTracking
from vla_deploy.safety import DriveSample

UNKNOWN_FAULT: Final = 0xFFFF


def drive_samples(
    names: Sequence[str],
    state: DriveState,
    tracking: WheelTracking,
    *,
    age_limit_s: float,
    dropped_out: bool,
) -> tuple[DriveSample, ...]:
    """Return each drive's sample; one that ceased to follow by itself has an unknown fault.

    `age_limit_s` is that of their driver.
    """
    age_s = state.age_s.tolist()
    return tuple(
        DriveSample(
            name=name,
            lost=state.lost[row],
            age_s=age_s[row],
            age_limit_s=age_limit_s,
            fault_code=_fault_code(state, row, dropped_out=dropped_out),
            commanded_rad_s=tracking.commanded_rad_s[row],
            measured_rad_s=tracking.measured_rad_s[row],
        )
        for row, name in enumerate(names)
    )


def _fault_code(state: DriveState, row: int, *, dropped_out: bool) -> int:
    if not state.faulted[row]:
        stands_off = state.power_state[row] is not PowerState.OPERATION_ENABLED
        return UNKNOWN_FAULT if dropped_out and stands_off else 0
    fault = state.fault[row]
    return UNKNOWN_FAULT if fault is None else fault.code
