"""Put what the planner has to say into words: brief, plain, and nothing promised.

Every sentence that a person hears or reads from the planner stands in one table. None holds a stop
word: the robot would take a person's for its own.
"""

import math
import re
from collections.abc import Callable, Mapping, Sequence
from enum import StrEnum
from itertools import zip_longest
from typing import Any, Final

from vla_deploy.planning.errors import BatteryLow, NotReadyToMove, NotUnderstood
from vla_deploy.plans.errors import PlanError
from vla_deploy.plans.plan import PUT_IN, Plan

_MOST_STEPS: Final = 6
_MOST_SPOKEN_CHARACTERS: Final = 160
_STOP_WORD: Final = re.compile(r"(?<![a-z])(?:stop|halt|freeze)(?![a-z])", re.IGNORECASE)


class Says(StrEnum):
    """List the planner's sentences; braces are filled."""

    WORKING = "One moment."
    CONFIRM = "Shall I {steps}?"
    LEFT_OUT = "You said {words}, which I may not have understood."
    HELD = "{question} I wait for you to say go."
    STILL_HELD = "I wait for you to say go."
    NOT_CLEAR = "Sorry, I did not get that. {question}"
    LEFT = "All right, I leave it."
    NO_ANSWER = "I got no answer, so I leave it."
    REPLACED = "I leave the other thing, then."
    NOTHING_ASKED = "Sorry, I am not waiting for an answer."
    STILL_UNCLEAR = "Sorry, I still do not know what you mean, so I leave it."
    HEARD_BADLY = "Sorry, I did not understand that. Please say it again."
    NOT_UNDERSTOOD = "Sorry, I did not understand that."
    NOT_READY = "Sorry, I may not move now."
    BATTERY_LOW = "Sorry, my battery is too low for that."
    REFUSED = "Sorry, I cannot do that: {reason}."
    AFTERWARDS = "I do that next."
    PAUSED = "I pause."
    GOES_ON = "I go on."
    NOTHING_GOES_ON = "Nothing is under way."
    MANY_WAIT = "Sorry, too many commands wait already."
    DONE = "Done."
    FAILED = "Sorry, that did not work: {reason}."


# What a person hears of errors whose message is for reading.
_SPOKEN: Final[Mapping[type[PlanError], Says]] = {
    NotUnderstood: Says.NOT_UNDERSTOOD,
    BatteryLow: Says.BATTERY_LOW,
    NotReadyToMove: Says.NOT_READY,
}
Parameters = Mapping[str, Any]
# What each skill is called when it is proposed.
_PHRASES: Final[Mapping[str, Callable[[Parameters], str]]] = {
    "navigate_to": lambda given: _going(given),
    "move": lambda given: _driving(float(given["distance_m"])),
    "turn": lambda given: _turning(math.degrees(float(given["angle_rad"]))),
    "look_at": lambda given: f"look {given.get('direction') or 'at ' + _the(given['object'])}",
    "find_object": lambda given: f"look for {_the(given['object'])}",
    "pick_up": lambda given: f"pick up {_the(given['object'])}",
    "place": lambda given: f"put it {given['relation']} {_the(given['destination'])}",
    "charge": lambda given: "go and charge",
    "sweep": lambda given: f"drive over the floor of {_the(given['place'])}",
    "inspect": lambda given: f"look at {_the(given['object'])} from two sides",
    "guard": lambda given: (
        f"keep watch {'at ' + _the(given['place']) if 'place' in given else 'here'}"
    ),
    "follow_person": lambda given: "follow you",
    "hand_over": lambda given: "hand it over",
    "open_gripper": lambda given: f"open my {_hand(given)}",
    "close_gripper": lambda given: f"close my {_hand(given)}",
    "move_arm": lambda given: f"bring my arms to the pose {given['pose']}",
    "speak": lambda given: f'say "{first_part(str(given["text"]))}"',
    "wait": lambda given: f"wait {float(given['duration_s']):g} seconds",
    "turn_on": lambda given: f"turn on {_the(given['device'])}",
    "turn_off": lambda given: f"turn off {_the(given['device'])}",
    "stop": lambda given: "stand still",
}


def spoken_refusal(reason: PlanError | str) -> str:
    """Return what is said aloud of a refusal: one sentence; the rest is to be read."""
    if isinstance(reason, Says):
        return reason
    for kind, sentence in _SPOKEN.items():
        if isinstance(reason, kind):
            return sentence
    return Says.REFUSED.format(reason=first_part(str(reason)))


def first_part(reason: str) -> str:
    """Return of a reason what fits into a spoken sentence, in words that stop nothing."""
    said = _STOP_WORD.sub("standstill", reason.split(";")[0])
    return said.strip(" .")[:_MOST_SPOKEN_CHARACTERS]


def steps_in_words(plan: Plan, called: Mapping[str, str]) -> str:
    """Return a plan as a person would say it: "go to the kitchen and pick up the red cup".

    Ways that were put in, or lead to a person, are left out. `called` maps ids, which a person does
    not know, to words.
    """
    told = [
        one
        for one, then in zip_longest(plan.actions, plan.actions[1:])
        if one.skill not in ("find_object", "navigate_to")
        or not (one.description == PUT_IN or (then and then.skill == "hand_over"))
    ]
    steps = [
        _PHRASES[one.skill](
            {name: called.get(str(value), value) for name, value in one.parameters.items()}
        )
        for one in told or plan.actions
    ]
    if len(steps) > _MOST_STEPS:
        steps = [*steps[:_MOST_STEPS], f"do {len(steps) - _MOST_STEPS} things more"]
    return listed(steps)


def listed(steps: Sequence[str]) -> str:
    """Return "one, two and three"."""
    if len(steps) < 2:
        return "".join(steps)
    return f"{', '.join(steps[:-1])} and {steps[-1]}"


def _going(given: Parameters) -> str:
    if "place" in given:
        return f"go to {_the(given['place'])}"
    return f"go to {_the(given['object'])}" if "object" in given else "drive to a point on the map"


def _driving(distance_m: float) -> str:
    way = "back" if distance_m < 0 else "forward"
    return f"drive {abs(distance_m):g} metres {way}"


def _turning(angle_deg: float) -> str:
    return f"turn {'right' if angle_deg < 0 else 'left'} by {abs(angle_deg):.0f} degrees"


def _the(name: object) -> str:
    return f"the {str(name).replace('_', ' ')}"


def _hand(given: Parameters) -> str:
    return f"{given['arm']} hand" if given.get("arm") else "hand"
