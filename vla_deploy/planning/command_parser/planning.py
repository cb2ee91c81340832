"""Turn the steps of an answer into actions, by the builders that the rules use.

What the steps refer to stays in the speaker's words: grounding resolves it and puts in ways,
searches and free hands, for every planner alike (`vla_deploy.planning.understanding`).
"""

import math
import re
from collections.abc import Callable, Mapping, Sequence
from typing import Final

from vla_deploy.planning.asking import Request
from vla_deploy.planning.command_parser.amounts import (
    METRES,
    RADIANS,
    SECONDS,
    amount_of,
    amount_words,
    is_silent,
)
from vla_deploy.planning.command_parser.grammar import Step
from vla_deploy.planning.command_parser.lending import kind_lent
from vla_deploy.planning.command_parser.spans import find_span
from vla_deploy.planning.errors import CannotBeDone, Declined, PlanInvalid, UnknownPlace
from vla_deploy.planning.plan import Action
from vla_deploy.planning.references import match_place
from vla_deploy.planning.rules import building, cleaning, moving, placing, telling
from vla_deploy.planning.understanding.insertions import is_surface
from vla_deploy.world.vocabulary import CONTAINERS, SYNONYMS

Skill = building.Step
DEFAULT_MOVE_M: Final = moving.DRIVE_M
DEFAULT_TURN_RAD: Final = moving.TURN_RAD
DEFAULT_WAIT_S: Final = 5.0
_SPEAKERS: Final = frozenset({"me", "us", "here", "over here"})
# What poses are called besides their names in robot files.
_POSES: Final[Mapping[str, str]] = {
    "tucked": "tuck", "fold": "tuck", "folded": "tuck", "stow": "tuck", "stowed": "tuck",
    "pull": "tuck", "carry": "tuck", "driving": "tuck", "travel": "tuck", "safe": "tuck",
    "carrying": "tuck", "resting": "rest", "relax": "rest", "lower": "rest", "sleep": "rest",
}  # fmt: skip
_CAN_PUT: Final = frozenset({"in", "on", "to", "next to", "near"})
_POSSESSIVES: Final = re.compile(r"\b(?:his|her|their|its)\b")
# What was copied beside a thing: "(get) a grip of (the red book)", "(what became) of the phone".
_BESIDE: Final = re.compile(r"^(?:(?:an? )?(?:grip|hold|grasp|ahold|rid) )?(?:of|about) ")
# These are answered from what is seen, held, or remembered when they are planned.
_OF_THE_MOMENT: Final = frozenset({"where", "ask", "tidy"})
Handler = Callable[["Steps", Step], list[Skill]]


class Steps:
    """Hold one answer beside the command that it is for."""

    def __init__(self, command: Sequence[str], request: Request) -> None:
        self._command = command
        self._request = request

    def actions(self, steps: Sequence[Step]) -> tuple[Action, ...]:
        """Return the actions of all steps, one after the other.

        Raises:
            Declined: it is no command.
            CannotBeDone: no skill does what a step asks for.
            UnknownPlace: it goes to a person, or back to where nobody knows.
            PlanInvalid: an amount is none.
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

    @property
    def request(self) -> Request:
        """Return what the command came with."""
        return self._request

    def says(self, word: str) -> bool:
        """Tell whether a word was said."""
        return word in self._command

    def spoken(self, step: Step, field: str) -> str:
        """Return the words of a field, with the articles that were said among them."""
        words = step[field].split()
        span = find_span(words, self._command)
        text = " ".join(words if span is None else span.spoken)
        text = _BESIDE.sub("", _POSSESSIVES.sub("the", text))
        return re.sub(
            r"\b(on|to|at|in) (left|right|middle|back|front)\b(?! of)", r"\1 the \2", text
        )

    def source(self, step: Step) -> tuple[list[Skill], str]:
        """Return the way to the room where things are, or words that say what they are on or in."""
        where = self._where_from(step)
        if not where:
            return [], ""
        world = self._request.world
        place = match_place(where, world.places)
        if place is not None and not is_surface(place, world):
            return [("navigate_to", {"place": place})], ""
        kinds = {SYNONYMS.get(word, word) for word in where.split()}
        return [], f" {'in' if kinds & CONTAINERS else 'on'} {where}"

    def things(self, step: Step) -> str:
        """Return what a step is about, each thing with where it is to be taken from."""
        _, behind = self.source(step)
        spoken, _, _ = kind_lent(self.spoken(step, "what")).partition(" from ")
        return " and ".join(part + behind for part in building.parts_of(spoken))

    def _where_from(self, step: Step) -> str:
        """Return "the kitchen" of "the cup from the kitchen", or of a field of its own."""
        if "from" in step:
            return self.spoken(step, "from")
        return self.spoken(step, "what").partition(" from ")[2] if "what" in step else ""

    def amount(self, step: Step, units: Mapping[str, float], default: float, bare: str) -> float:
        """Return the amount of a step in SI units.

        Raises:
            PlanInvalid: its words are no amount.
        """
        if "by" not in step:
            return default
        words = step["by"].split()
        value = amount_of(words, units, bare)
        if value is None and (told := amount_words(words, units)):
            value = amount_of(told, units, bare)  # more was copied than the amount
        if value is None and is_silent(words):
            return default
        if value is None:
            raise PlanInvalid([f'"{step["by"]}" is no amount that I know'])
        return value


def are_of_the_moment(steps: Sequence[Step]) -> bool:
    """Tell whether the same words may mean other actions a moment later."""
    return any(one["do"] in _OF_THE_MOMENT or one.get("where") == "back" for one in steps)


def _go(steps: Steps, step: Step) -> list[Skill]:
    where = step["where"]
    if where in _SPEAKERS:
        return [("navigate_to", {"place": "here"})]
    if where == "back":
        return [_back(steps.request)]
    place = re.sub(r" with (?:it|them|that|this)$", "", steps.spoken(step, "where"))
    return building.go({"place": place}, steps.request)


def _back(request: Request) -> Skill:
    """Return the way to where the robot stood when it got the command before."""
    poses = [one.here for one in request.conversation.turns if one.here is not None]
    if not poses:
        raise UnknownPlace("back", set(request.world.places.values()))
    x_m, y_m, yaw_rad = (round(value, 3) for value in poses[-1])
    return "navigate_to", {"x_m": x_m, "y_m": y_m, "yaw_rad": yaw_rad}


def _pick(steps: Steps, step: Step) -> list[Skill]:
    way, _ = steps.source(step)
    return way + building.pick({"object": steps.things(step), **_arm(step)}, steps.request)


def _put(steps: Steps, step: Step) -> list[Skill]:
    relation = step.get("how", "to")
    if relation not in _CAN_PUT:
        raise CannotBeDone(f"I can put things in, on or next to something, not {relation} it")
    way, _ = steps.source(step)
    things = steps.things(step)
    if "where" not in step:
        down = placing.put_away if steps.says("away") else _put_down
        return way + down({"object": things}, steps.request)
    where = {"destination": steps.spoken(step, "where")}
    where |= {} if relation == "to" else {"relation": relation}
    return way + [("place", {"object": one, **where}) for one in building.parts_of(things)]


def _put_down(groups: building.Groups, _: Request) -> list[Skill]:
    return [("place", {"object": one}) for one in building.parts_of(groups["object"])]


def _bring(steps: Steps, step: Step) -> list[Skill]:
    way, behind = steps.source(step)
    parts = building.parts_of(kind_lent(steps.spoken(step, "what")).partition(" from ")[0])
    brought: list[Skill] = []
    for part in parts:
        picked, *back = building.bring({"object": part}, steps.request)
        brought += [*way, (picked[0], {"object": part + behind}), *_delivered(steps, step, back)]
    return brought


def _delivered(steps: Steps, step: Step, back: list[Skill]) -> list[Skill]:
    """Return the way to where somebody is to get it: back to the speaker, or to a place.

    Raises:
        UnknownPlace: it is to go to a person, of whom nobody knows where they are.
    """
    if step.get("to", "me") in _SPEAKERS:
        return back
    to_whom, places = steps.spoken(step, "to"), steps.request.world.places
    if match_place(to_whom, places) is None:
        raise UnknownPlace(to_whom, set(places.values()))
    return [("navigate_to", {"place": to_whom})]


def _give(_steps: Steps, _step: Step) -> list[Skill]:
    return [("hand_over", {})]


def _find(steps: Steps, step: Step) -> list[Skill]:
    way, _ = steps.source(step)
    return way + building.find({"object": steps.things(step)}, steps.request)


def _where(steps: Steps, step: Step) -> list[Skill]:
    return telling.tell_or_find({"object": steps.spoken(step, "what")}, steps.request)


def _look(steps: Steps, step: Step) -> list[Skill]:
    if "way" in step:
        return [("look_at", {"direction": step["way"]})]
    if step.get("what", "me") in _SPEAKERS:
        return [("look_at", {"direction": "ahead"})]
    return [("look_at", {"object": steps.spoken(step, "what")})]


def _move(steps: Steps, step: Step) -> list[Skill]:
    sign = -1.0 if step["way"] == "backward" else 1.0
    return [("move", {"distance_m": sign * steps.amount(step, METRES, DEFAULT_MOVE_M, "m")})]


def _turn(steps: Steps, step: Step) -> list[Skill]:
    sign = -1.0 if step["way"] == "right" else 1.0
    default = math.pi if step["way"] == "around" else DEFAULT_TURN_RAD
    return [("turn", {"angle_rad": sign * steps.amount(step, RADIANS, default, "degree")})]


def _arm(step: Step) -> dict[str, str]:
    return {"arm": step["arm"]} if "arm" in step else {}


def _pose(_steps: Steps, step: Step) -> list[Skill]:
    name = _POSES.get(step["name"], step["name"].replace(" ", "_"))
    return [("move_arm", {"pose": name, **_arm(step)})]


def _say(_steps: Steps, step: Step) -> list[Skill]:
    text = step["text"]
    return [("speak", {"text": f"{text[:1].upper()}{text[1:]}."})]


def _wait(steps: Steps, step: Step) -> list[Skill]:
    return [("wait", {"duration_s": steps.amount(step, SECONDS, DEFAULT_WAIT_S, "second")})]


def _ask(steps: Steps, step: Step) -> list[Skill]:
    return _ANSWERS[step["about"]]({}, steps.request)


def _tidy(steps: Steps, step: Step) -> list[Skill]:
    place = {"place": steps.spoken(step, "where")} if "where" in step else {}
    return cleaning.tidy(place, steps.request)


def _doing(_: building.Groups, request: Request) -> list[Skill]:
    turns = request.conversation.turns
    told = f"The last that I was told is: {turns[-1].said}." if turns else "I wait for a command."
    return [("speak", {"text": told})]


def _refused(error: type[Declined | CannotBeDone], why: str) -> Handler:
    def handle(_steps: Steps, _step: Step) -> list[Skill]:
        raise error(why)

    return handle


_ANSWERS: Final[Mapping[str, building.Builder]] = {
    "holding": telling.tell_hands,
    "seeing": telling.tell_sight,
    "place": telling.tell_place,
    "able": telling.tell_abilities,
    "doing": _doing,
}
_HANDLERS: Final[Mapping[str, Handler]] = {
    "go": _go,
    "pick": _pick,
    "put": _put,
    "bring": _bring,
    "give": _give,
    "find": _find,
    "where": _where,
    "look": _look,
    "move": _move,
    "turn": _turn,
    "open": lambda _, step: [("open_gripper", _arm(step))],
    "close": lambda _, step: [("close_gripper", _arm(step))],
    "pose": _pose,
    "say": _say,
    "wait": _wait,
    "stop": lambda _steps, _step: [("stop", {})],
    "ask": _ask,
    "tidy": _tidy,
    "nothing": _refused(CannotBeDone, "it says what not to do, so I leave it"),
    "impossible": _refused(CannotBeDone, "none of my skills does that"),
    "unknown": _refused(Declined, "it is no command that I know"),
}
