"""Say what control needs to run under another profile, and refuse what it cannot do in motion."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

from platforms import Profile, ProfileError
from vla_deploy.robots import RobotDescription
from vla_deploy.runtime.node import NeedsRestart

STATUS_HZ: Final = 20.0
# A cycle's share of the servo bus: one sync write and one fast sync read, by the servo.
_WIRE_BITS: Final = 300
_MAX_BUS_RATIO: Final = 0.8
_RAMPED_BY_CYCLE: Final = "cyclic_synchronous_velocity"


@dataclass(frozen=True, slots=True, kw_only=True)
class Tuning:
    """Hold what may change between two ticks."""

    period_s: float
    status_every: int


def tuning_of(profile: Profile) -> Tuning:
    """Return the tuning that a profile asks for."""
    rate_hz = profile.control_rate_hz
    return Tuning(period_s=1.0 / rate_hz, status_every=max(1, round(rate_hz / STATUS_HZ)))


def retuned(robot: RobotDescription, before: Profile, after: Profile) -> Tuning:
    """Return the tuning for a running control.

    Raises:
        ProfileError: the servo bus is too slow for the rate.
        NeedsRestart: something would have to be set up anew, which is done at standstill.
    """
    _refuse_busy_bus(robot, after)
    reasons = "; ".join(_set_up_anew(robot, before, after))
    if reasons:
        raise NeedsRestart(reasons)
    return tuning_of(after)


def _refuse_busy_bus(robot: RobotDescription, profile: Profile) -> None:
    bus = robot.servo_bus
    count = len(bus.all_servos)
    limit_hz = _MAX_BUS_RATIO * bus.baud / (_WIRE_BITS * count)
    if profile.control_rate_hz > limit_hz:
        raise ProfileError(
            (
                f"control_rate_hz: expected at most {limit_hz:.0f} Hz, for {count} "
                f"servos at {bus.baud} baud, got {profile.control_rate_hz:g}",
            )
        )


def _set_up_anew(robot: RobotDescription, before: Profile, after: Profile) -> Iterator[str]:
    for key, device in (("bus_watchdog_s", "servos"), ("can_heartbeat_s", "wheel drives")):
        old, new = getattr(before, key), getattr(after, key)
        if old != new:
            yield f"{key}: {old:g} s -> {new:g} s is set up in the {device} at standstill only"
    if before.memory_lock != after.memory_lock:
        yield "memory_lock: to lock what is in use takes longer than a tick"
    drives = robot.parts.can_bus.drives if robot.parts.can_bus else ()
    in_step = any(drive.mode == _RAMPED_BY_CYCLE for drive in drives)
    if in_step and before.control_rate_hz != after.control_rate_hz:
        yield f"control_rate_hz: drives in {_RAMPED_BY_CYCLE} are set up for the period"
