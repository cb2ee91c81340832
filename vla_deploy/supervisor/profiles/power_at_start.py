"""Take the board to the power mode of the profile that a run starts under."""

import logging

from platforms import ProfileError
from platforms.power_switch import PowerSwitch

_log = logging.getLogger(__name__)


def set_at_start(power: PowerSwitch, mode: str) -> None:
    """Set a mode, which may take seconds; after a failure the robot runs in the one there is."""
    try:
        power.check(mode)
        failure = power.set(mode)
    except ProfileError as error:
        failure = "; ".join(error.faults)
    if failure:
        _log.warning("degraded: %s", failure)
    elif mode:
        _log.info("power mode %s", mode)
