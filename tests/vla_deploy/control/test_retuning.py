from dataclasses import replace

import pytest

from platforms import ProfileError, load_profile
from vla_deploy.control.modes.retuning import require_bus_rate, retuned, tuning_of
from vla_deploy.control.reporting.telemetry import TickClock
from vla_deploy.robots import load_robot
from vla_deploy.runtime.node import NeedsRestart

ROBOT = load_robot("butler")
DESKTOP = load_profile("desktop")


def test_a_rate_changes_in_motion_and_the_status_keeps_its_own():
    tuning = retuned(ROBOT, DESKTOP, replace(DESKTOP, control_rate_hz=200))
    assert (tuning.period_s, tuning.status_every) == (0.005, 10)
    assert tuning_of(DESKTOP).status_every == 12


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"bus_watchdog_s": 0.5}, "bus_watchdog_s: 0.3 s -> 0.5 s is set up in the servos"),
        ({"memory_lock": True}, "memory_lock: to lock what is in use takes longer than a tick"),
        ({"can_heartbeat_s": 0.2}, "can_heartbeat_s: 0.1 s -> 0.2 s is set up in the wheel drives"),
    ],
)
def test_what_devices_are_set_up_with_needs_a_restart(change, reason):
    with pytest.raises(NeedsRestart, match=reason):
        retuned(ROBOT, DESKTOP, replace(DESKTOP, **change))


def test_drives_that_are_set_up_for_the_period_need_a_restart():
    drives = tuple(
        replace(drive, mode="cyclic_synchronous_velocity") for drive in ROBOT.can_bus.drives
    )
    can_bus = replace(ROBOT.can_bus, drives=drives)
    robot = replace(ROBOT, parts=replace(ROBOT.parts, can_bus=can_bus))
    with pytest.raises(NeedsRestart, match="drives in cyclic_synchronous_velocity"):
        retuned(robot, DESKTOP, replace(DESKTOP, control_rate_hz=200))
    assert retuned(robot, DESKTOP, replace(DESKTOP, executor_rate_hz=20)).period_s == 0.004


def test_a_rate_that_the_servo_bus_cannot_carry_is_refused():
    with pytest.raises(ProfileError, match="expected at most 500 Hz, for 16 servos at 3000000"):
        retuned(ROBOT, DESKTOP, replace(DESKTOP, control_rate_hz=510))
    assert retuned(ROBOT, DESKTOP, replace(DESKTOP, control_rate_hz=500)).period_s == 0.002


@pytest.mark.parametrize(("robot", "most_hz"), [("so101_pair", 303), ("wx250s", 296)])
def test_each_family_of_servos_has_its_share_of_the_wire(robot: str, most_hz: int) -> None:
    described = load_robot(robot)
    require_bus_rate(described, replace(DESKTOP, control_rate_hz=250))
    with pytest.raises(ProfileError, match=f"expected at most {most_hz} Hz"):
        require_bus_rate(described, replace(DESKTOP, control_rate_hz=most_hz + 1))


def test_a_tick_is_late_against_the_period_that_led_up_to_it():
    ticks = TickClock(0.010)
    ticks.begin(0)
    ticks.retune(0.004)
    ticks.begin(10_000_000)
    assert ticks.late_ticks == 0, "the old period led up to it"
    ticks.begin(14_000_000)
    assert ticks.late_ticks == 0
    ticks.begin(24_000_000)
    assert ticks.late_ticks == 1
