"""Decide control's mode: one pure function of mode, verdict and acts."""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from typing import Final

from vla_deploy.ipc.payloads.motion import ControlStateName
from vla_deploy.safety import Reaction


class Mode(Enum):
    """Name what control is doing about power and motion."""

    DISARMED = "disarmed"
    ARMING = "arming"
    ARMED = "armed"
    DISARMING = "disarming"
    PAUSING = "pausing"
    PAUSED = "paused"
    STOPPING = "stopping"
    STOPPED = "stopped"


@dataclass(frozen=True, slots=True, kw_only=True)
class ModeInputs:
    """Carry what the next mode depends on; `armed` is None while arming is under way."""

    reaction: Reaction
    latched: bool
    arm: bool
    disarm: bool
    armed: bool | None
    at_rest: bool


def next_mode(mode: Mode, inputs: ModeInputs) -> Mode:
    """Return the mode of the next tick; a stop goes before everything else.

    DISARMED gets there only by arming, and STOPPED is left only when nothing demands the stop any
    more, which for a latched cause takes a reset. A protective stop pauses an armed robot: once it
    stands, it is armed again as soon as nothing demands that stop any more.
    """
    stop = inputs.reaction >= Reaction.HOLD
    pause = inputs.reaction is Reaction.PROTECTIVE_STOP
    match mode:
        case Mode.DISARMED:
            if stop and inputs.latched:
                return Mode.STOPPING
            return Mode.ARMING if inputs.arm and not stop else mode
        case Mode.ARMING:
            if stop:
                return Mode.STOPPING
            if inputs.disarm:
                return Mode.DISARMING
            return {None: mode, True: Mode.ARMED, False: Mode.DISARMED}[inputs.armed]
        case Mode.ARMED | Mode.PAUSING | Mode.PAUSED:
            if stop:
                return Mode.STOPPING
            if inputs.disarm:
                return Mode.DISARMING
            return _next_while_armed(mode, pause, inputs.at_rest)
        case Mode.DISARMING:
            if stop:
                return Mode.STOPPING
            return Mode.DISARMED if inputs.at_rest else mode
        case Mode.STOPPING:
            return Mode.STOPPED if inputs.at_rest else mode
        case Mode.STOPPED:
            return mode if stop else Mode.DISARMED


def _next_while_armed(mode: Mode, pause: bool, at_rest: bool) -> Mode:
    if mode is Mode.PAUSING:
        return Mode.PAUSED if at_rest else mode
    if not pause:
        return Mode.ARMED
    return Mode.PAUSING if mode is Mode.ARMED else mode


def status_name(mode: Mode, reaction: Reaction) -> ControlStateName:
    """Return the mode in the words of `control_status`; fault: it cannot be armed at present."""
    if mode is Mode.DISARMED and reaction >= Reaction.HOLD:
        return "fault"
    return _WORDS[mode]


_WORDS: Final[Mapping[Mode, ControlStateName]] = {
    Mode.DISARMED: "disarmed",
    Mode.ARMING: "disarmed",
    Mode.ARMED: "armed",
    Mode.DISARMING: "stopping",
    Mode.PAUSING: "protective_stop",
    Mode.PAUSED: "protective_stop",
    Mode.STOPPING: "stopping",
    Mode.STOPPED: "stopped",
}
