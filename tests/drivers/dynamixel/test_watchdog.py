"""A trip is left only by clearing it; every pair of state and event has one outcome."""

import pytest

from drivers.dynamixel.watchdog import (
    TRANSITIONS,
    WatchdogEvent,
    WatchdogState,
    next_state,
    watchdog_units,
)

OFF, ARMED, TRIPPED, CLEARED = WatchdogState


def test_only_clearing_leaves_a_trip() -> None:
    outcomes = {event: next_state(TRIPPED, event) for event in WatchdogEvent}
    assert outcomes.pop(WatchdogEvent.CLEAR) is CLEARED
    assert set(outcomes.values()) == {TRIPPED}


@pytest.mark.parametrize("state", [OFF, ARMED, CLEARED])
def test_a_trip_is_noted_in_every_state(state: WatchdogState) -> None:
    assert next_state(state, WatchdogEvent.TRIP) is TRIPPED


def test_clearing_alone_does_not_arm() -> None:
    assert next_state(CLEARED, WatchdogEvent.ARM) is ARMED
    assert next_state(CLEARED, WatchdogEvent.CLEAR) is CLEARED
    assert next_state(OFF, WatchdogEvent.CLEAR) is OFF


def test_pairs_without_a_row_change_nothing() -> None:
    for state in WatchdogState:
        for event in WatchdogEvent:
            if (state, event) not in TRANSITIONS:
                assert next_state(state, event) is state


@pytest.mark.parametrize(
    ("timeout_s", "units"), [(0.02, 1), (0.1, 5), (0.11, 6), (0.06, 3), (2.54, 127)]
)
def test_timeouts_are_rounded_up_to_the_servos_unit(timeout_s: float, units: int) -> None:
    assert watchdog_units(timeout_s) == units


@pytest.mark.parametrize("timeout_s", [0.0, -1.0, 2.56])
def test_a_timeout_the_servo_cannot_hold_is_refused(timeout_s: float) -> None:
    with pytest.raises(ValueError, match="bus watchdog must be"):
        watchdog_units(timeout_s)
