"""Turn the steps of an answer into actions; what they refer to is left to the resolver.

Ways there, searches and free hands are put in for every planner alike
(`vla_deploy.planning.understanding`).
"""

import math
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, Final

from vla_deploy.planning.asking import Request
from vla_deploy.planning.command_parser.amounts import METRES, RADIANS, SECONDS, amount_of
from vla_deploy.planning.command_parser.answers import own_answer
from vla_deploy.planning.command_parser.grammar import Step
from vla_deploy.planning.command_parser.spans import find_span
from vla_deploy.planning.errors import Declined, PlanInvalid, UnknownPlace
from vla_deploy.planning.plan import Action
from vla_deploy.planning.references import match_place
from vla_deploy.world.vocabulary import CONTAINERS, SYNONYMS

Skill = tuple[str, Mapping[str, Any]]
DEFAULT_MOVE_M: Final = 0.5
DEFAULT_TURN_RAD: Final = 0.5 * math.pi
DEFAULT_WAIT_S: Final = 5.0
_SPEAKERS: Final = frozenset({"me", "us", "here", "over here"})
_PRONOUNS: Final = frozenset({"it", "that", "this", "them", "those", "these", "that one"})
# What poses are called besides their names in robot files.
_POSES: Final[Mapping[str, str]] = {
    "tucked": "tuck", "fold": "tuck", "folded": "tuck", "stow": "tuck", "stowed": "tuck",
    "pull": "tuck", "carry": "tuck", "driving": "tuck", "travel": "tuck", "safe": "tuck",
    "carrying": "tuck", "resting": "rest", "relax": "rest", "lower": "rest", "sleep": "rest",
}  # fmt: skip
_CAN_PUT: Final = frozenset({"in", "on", "to"})


class Steps:
    """Hold one answer beside the command that it is for."""

    def __init__(self, command: Sequence[str], request: Request) -> None:
        self._command = command
        self._request = request

    def actions(self, steps: Sequence[Step]) -> tuple[Action, ...]:
        """Return the actions of all steps, one after the other.

        Raises:
            Declined: a step is none that this robot knows.
            UnknownPlace: a person or way back that nobody knows.
            PlanInvalid: a step asks for what no skill does, or for an amount that is none.
        """
        skills = [skill for step in steps for skill in _HANDLERS[step["do"]](self, step)]
        return tuple(
            Action(
                id=f"a{number}",
                skill=skill,
                parameters=dict(parameters),
                depends_on=(f"a{number - 1}",) if number > 1 else (),
            )
            for number, (skill, parameters) in enumerate(skills, start=1)
        )

    # --- what handlers ask ------------------------------------------------------------------

    def spoken(self, step: Step, field: str) -> str:
        """Return the words of a field, with the articles that were said among them."""
        words = step[field].split()
        span = find_span(words, self._command)
        text = " ".join(words if span is None else span.spoken)
        return re.sub(
            r"\b(on|to|at|in) (left|right|middle|back|front)\b(?! of)", r"\1 the \2", text
        )

    def things(self, step: Step) -> list[str]:
        """Return what a step is about: "the cup and the ball" are two."""
        text = self.spoken(step, "what")
        return [one for one in re.split(r"\band\b", text) if one.strip()] or [text]

    def is_place(self, text: str) -> bool:
        """Tell whether a text is the name of a place."""
        return match_place(text, self._request.world.places) is not None

    def here(self, to_whom: str) -> Skill:
        """Return the way to where the command was given.

        Raises:
            UnknownPlace: nobody knows where that is.
        """
        if self._request.here is None or to_whom not in _SPEAKERS:
            raise UnknownPlace(to_whom, set(self._request.world.places.values()))
        x_m, y_m, yaw_rad = (round(value, 3) for value in self._request.here)
        return "navigate_to", {"x_m": x_m, "y_m": y_m, "yaw_rad": yaw_rad}

    def back(self) -> Skill:
        """Return the way to where the robot stood when it got the command before.

        Raises:
            UnknownPlace: there was none.
        """
        turns = [one for one in self._request.conversation.turns if one.here is not None]
        if not turns or turns[-1].here is None:
            raise UnknownPlace("back", set(self._request.world.places.values()))
        x_m, y_m, yaw_rad = (round(value, 3) for value in turns[-1].here)
        return "navigate_to", {"x_m": x_m, "y_m": y_m, "yaw_rad": yaw_rad}

    def amount(self, step: Step, units: Mapping[str, float], default: float, bare: str) -> float:
        """Return the amount of a step in SI units.

        Raises:
            PlanInvalid: its words are no amount.
        """
        if "by" not in step:
            return default
        value = amount_of(step["by"].split(), units, bare)
        if value is None:
            raise PlanInvalid([f'"{step["by"]}" is no amount that I know'])
        return value

    @property
    def request(self) -> Request:
        """Return what the command came with."""
        return self._request


def _go(steps: Steps, step: Step) -> Iterator[Skill]:
    where = step["where"]
    if where in _SPEAKERS:
        yield steps.here(where)
    elif where == "back":
        yield steps.back()
    else:
        spoken = steps.spoken(step, "where")
        yield "navigate_to", {"place" if steps.is_place(spoken) else "object": spoken}


def _from(steps: Steps, step: Step) -> tuple[list[Skill], str]:
    """Return the way to where things are to be taken from, or the words that say where."""
    if "from" not in step:
        return [], ""
    source = steps.spoken(step, "from")
    place = match_place(source, steps.request.world.places)
    if place is not None and place not in steps.request.world.furniture:
        return [("navigate_to", {"place": place})], ""
    kinds = {SYNONYMS.get(word, word) for word in source.split()}
    return [], f" {'in' if kinds & CONTAINERS else 'on'} {source}"


def _pick(steps: Steps, step: Step) -> Iterator[Skill]:
    way, behind = _from(steps, step)
    yield from way
    arm = {"arm": step["arm"]} if "arm" in step else {}
    for thing in steps.things(step):
        yield "pick_up", {"object": thing.strip() + behind, **arm}


def _put(steps: Steps, step: Step) -> Iterator[Skill]:
    relation = step.get("how", "to")
    if relation not in _CAN_PUT:
        raise PlanInvalid([f"I can put things in or on something, not {relation} it"])
    where: dict[str, Any] = {}
    if "where" in step:
        where = {"destination": steps.spoken(step, "where")}
        where |= {} if relation == "to" else {"relation": relation}
    for thing in steps.things(step):
        yield "place", {"object": thing.strip(), **where}


def _bring(steps: Steps, step: Step) -> Iterator[Skill]:
    way, behind = _from(steps, step)
    back = steps.here(step.get("to", "me"))
    for thing in steps.things(step):
        yield from way
        yield "pick_up", {"object": thing.strip() + behind}
        yield back
        words = re.sub(r"^(?:my|our|the|a|an|some)\b", "the", thing.strip())
        told = "Here it is." if words in _PRONOUNS else f"Here is {words}."
        yield "speak", {"text": told}


def _give(_steps: Steps, _step: Step) -> Iterator[Skill]:
    yield "speak", {"text": "Take it, then tell me to open my hand."}


def _find(steps: Steps, step: Step) -> Iterator[Skill]:
    way, behind = _from(steps, step)
    yield from way
    for thing in steps.things(step):
        yield "find_object", {"object": thing.strip() + behind}


def _look(steps: Steps, step: Step) -> Iterator[Skill]:
    if "way" in step:
        yield "look_at", {"direction": step["way"]}
    elif step.get("what", "me") in _SPEAKERS:
        yield "look_at", {"direction": "ahead"}
    else:
        yield "look_at", {"object": steps.spoken(step, "what")}


def _move(steps: Steps, step: Step) -> Iterator[Skill]:
    sign = -1.0 if step["way"] == "backward" else 1.0
    yield "move", {"distance_m": sign * steps.amount(step, METRES, DEFAULT_MOVE_M, "m")}


def _turn(steps: Steps, step: Step) -> Iterator[Skill]:
    sign = -1.0 if step["way"] == "right" else 1.0
    default = math.pi if step["way"] == "around" else DEFAULT_TURN_RAD
    yield "turn", {"angle_rad": sign * steps.amount(step, RADIANS, default, "degree")}


def _gripper(skill: str) -> Callable[[Steps, Step], Iterator[Skill]]:
    def handle(_steps: Steps, step: Step) -> Iterator[Skill]:
        yield skill, {"arm": step["arm"]} if "arm" in step else {}

    return handle


def _pose(_steps: Steps, step: Step) -> Iterator[Skill]:
    name = _POSES.get(step["name"], step["name"].replace(" ", "_"))
    yield "move_arm", {"pose": name, **({"arm": step["arm"]} if "arm" in step else {})}


def _say(_steps: Steps, step: Step) -> Iterator[Skill]:
    text = step["text"]
    yield "speak", {"text": f"{text[:1].upper()}{text[1:]}."}


def _wait(steps: Steps, step: Step) -> Iterator[Skill]:
    yield "wait", {"duration_s": steps.amount(step, SECONDS, DEFAULT_WAIT_S, "second")}


def _stop(_steps: Steps, _step: Step) -> Iterator[Skill]:
    yield "stop", {}


def _ask(steps: Steps, step: Step) -> Iterator[Skill]:
    yield "speak", {"text": own_answer(step["about"], steps.request)}


def _declined(why: str) -> Callable[[Steps, Step], Iterator[Skill]]:
    def handle(_steps: Steps, _step: Step) -> Iterator[Skill]:
        raise Declined(why)

    return handle


_HANDLERS: Final[Mapping[str, Callable[[Steps, Step], Iterator[Skill]]]] = {
    "go": _go,
    "pick": _pick,
    "put": _put,
    "bring": _bring,
    "give": _give,
    "find": _find,
    "where": _find,
    "look": _look,
    "move": _move,
    "turn": _turn,
    "open": _gripper("open_gripper"),
    "close": _gripper("close_gripper"),
    "pose": _pose,
    "say": _say,
    "wait": _wait,
    "stop": _stop,
    "ask": _ask,
    "tidy": _declined("it asks to tidy up, which I cannot plan by myself"),
    "nothing": _declined("it says what not to do"),
    "impossible": _declined("it asks for what none of my skills does"),
    "unknown": _declined("it is no command that I know"),
}
