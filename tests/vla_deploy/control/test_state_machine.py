"""Hold every mode to what leads out of it, and to nothing else."""

import itertools
from typing import Any

import pytest

from vla_deploy.control.modes.state_machine import Mode, ModeInputs, next_mode, status_name
from vla_deploy.safety import Reaction

CALM: dict[str, Any] = {
    "reaction": Reaction.NONE,
    "latched": False,
    "arm": False,
    "disarm": False,
    "armed": None,
    "at_rest": False,
}
STOP: dict[str, Any] = {"reaction": Reaction.HOLD, "latched": True}
PAUSE: dict[str, Any] = {"reaction": Reaction.PROTECTIVE_STOP}
PAUSES = (Mode.PAUSING, Mode.PAUSED)


@pytest.mark.parametrize(
    ("mode", "changes", "expected"),
    [
        (Mode.DISARMED, {}, Mode.DISARMED),
        (Mode.DISARMED, {"arm": True}, Mode.ARMING),
        (Mode.DISARMED, {"arm": True, "reaction": Reaction.BASE_RAMP}, Mode.ARMING),
        (Mode.DISARMED, {"arm": True, "reaction": Reaction.HOLD}, Mode.DISARMED),
        (Mode.DISARMED, STOP, Mode.STOPPING),
        (Mode.ARMING, {}, Mode.ARMING),
        (Mode.ARMING, {"armed": True}, Mode.ARMED),
        (Mode.ARMING, {"armed": False}, Mode.DISARMED),
        (Mode.ARMING, {"armed": True, "disarm": True}, Mode.DISARMING),
        (Mode.ARMING, {"armed": True, **STOP}, Mode.STOPPING),
        (Mode.ARMED, {}, Mode.ARMED),
        (Mode.ARMED, {"reaction": Reaction.BASE_RAMP}, Mode.ARMED),
        (Mode.ARMED, {"disarm": True}, Mode.DISARMING),
        (Mode.ARMED, {"disarm": True, **STOP}, Mode.STOPPING),
        (Mode.ARMED, PAUSE, Mode.PAUSING),
        (Mode.ARMED, {"disarm": True, **PAUSE}, Mode.DISARMING),
        (Mode.PAUSING, PAUSE, Mode.PAUSING),
        (Mode.PAUSING, {}, Mode.PAUSING),
        (Mode.PAUSING, {"at_rest": True, **PAUSE}, Mode.PAUSED),
        (Mode.PAUSING, {"at_rest": True}, Mode.PAUSED),
        (Mode.PAUSING, {"at_rest": True, **STOP}, Mode.STOPPING),
        (Mode.PAUSED, {"at_rest": True, **PAUSE}, Mode.PAUSED),
        (Mode.PAUSED, {}, Mode.ARMED),
        (Mode.PAUSED, {"reaction": Reaction.BASE_RAMP}, Mode.ARMED),
        (Mode.PAUSED, {"arm": True, **PAUSE}, Mode.PAUSED),
        (Mode.PAUSED, {"disarm": True, **PAUSE}, Mode.DISARMING),
        (Mode.PAUSED, STOP, Mode.STOPPING),
        (Mode.ARMING, {"armed": True, **PAUSE}, Mode.ARMED),
        (Mode.DISARMED, {"arm": True, **PAUSE}, Mode.ARMING),
        (Mode.STOPPED, PAUSE, Mode.DISARMED),
        (Mode.DISARMING, {}, Mode.DISARMING),
        (Mode.DISARMING, {"at_rest": True}, Mode.DISARMED),
        (Mode.DISARMING, {"at_rest": True, **STOP}, Mode.STOPPING),
        (Mode.STOPPING, STOP, Mode.STOPPING),
        (Mode.STOPPING, {}, Mode.STOPPING),
        (Mode.STOPPING, {"at_rest": True, **STOP}, Mode.STOPPED),
        (Mode.STOPPED, STOP, Mode.STOPPED),
        (Mode.STOPPED, {"arm": True, **STOP}, Mode.STOPPED),
        (Mode.STOPPED, {}, Mode.DISARMED),
        (Mode.STOPPED, {"arm": True}, Mode.DISARMED),
    ],
)
def test_each_mode_is_left_as_the_rules_say(
    mode: Mode, changes: dict[str, Any], expected: Mode
) -> None:
    assert next_mode(mode, ModeInputs(**{**CALM, **changes})) is expected


def every_input() -> list[ModeInputs]:
    flags = (False, True)
    return [
        ModeInputs(
            reaction=reaction, latched=latched, arm=arm, disarm=disarm, armed=armed, at_rest=rest
        )
        for reaction, latched, arm, disarm, armed, rest in itertools.product(
            Reaction, flags, flags, flags, (None, False, True), flags
        )
    ]


def test_only_arming_and_the_end_of_a_pause_lead_to_armed() -> None:
    for mode, inputs in itertools.product(Mode, every_input()):
        if next_mode(mode, inputs) is Mode.ARMED:
            assert mode in (Mode.ARMING, Mode.ARMED, Mode.PAUSED)


def test_only_an_armed_robot_is_paused() -> None:
    for mode, inputs in itertools.product(Mode, every_input()):
        if next_mode(mode, inputs) in PAUSES:
            assert mode in (Mode.ARMED, *PAUSES)


def test_no_mode_keeps_moving_under_a_latched_stop() -> None:
    for mode, inputs in itertools.product(Mode, every_input()):
        if inputs.latched and inputs.reaction >= Reaction.HOLD:
            assert next_mode(mode, inputs) in (Mode.STOPPING, Mode.STOPPED)


def test_the_status_speaks_the_documented_words() -> None:
    words = {status_name(mode, reaction) for mode in Mode for reaction in Reaction}
    assert words == {"disarmed", "armed", "stopping", "stopped", "fault", "protective_stop"}
    assert status_name(Mode.DISARMED, Reaction.HOLD) == "fault"
    assert status_name(Mode.STOPPED, Reaction.HOLD) == "stopped"
