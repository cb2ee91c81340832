"""Turn the steps of an answer into actions, by the builders that patterns use, too.

What the steps refer to stays in the speaker's words: grounding resolves it and puts in ways,
searches and free hands, for every planner alike (`vla_deploy.planning.understanding`).
"""

import math
import re
from collections.abc import Callable, Mapping, Sequence
from typing import Final

from vla_deploy.planning.builders import answering, moving, placing, tidying
from vla_deploy.planning.builders import steps as building
from vla_deploy.planning.command_parser.grammar import Step
from vla_deploy.planning.command_parser.spoken import Spoken
from vla_deploy.planning.errors import CannotBeDone, Declined, UnknownPlace
from vla_deploy.planning.interfaces import Request
from vla_deploy.planning.plan import Action
from vla_deploy.planning.prohibition import StandingOrder
from vla_deploy.planning.prohibitions import order_of
from vla_deploy.planning.references import match_place

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
Handler = Callable[[Spoken, Step], list[Skill]]


class Steps(Spoken):
    """Make actions of answers to a command."""

    def actions(self, steps: Sequence[Step]) -> tuple[Action, ...]:
        """Return the actions of all steps, one after the other.

        Raises:
            Declined: it is no command.
            CannotBeDone: no skill does what a step asks for.
            UnknownPlace: it goes to a person, or back to where nobody knows.
            PlanInvalid: an amount is none.
        """
        skills = [skill for step in steps for skill in _HANDLERS[step["do"]](self, step)]
        return building.chained(skills)

    def order(self, step: Step) -> StandingOrder:
        """Return what a step forbids or permits.

        Raises:
            CannotBeDone: that is nothing which may be forbidden, or nothing that is.
        """
        said = (("what", "thing"), ("where", "place"))
        groups = {name: self.spoken(step, field) for field, name in said if field in step}
        return order_of(groups, step["do"] == "forbid", self.request)


def _go(spoken: Spoken, step: Step) -> list[Skill]:
    if "else" in step:
        raise CannotBeDone("every place that I know is there: say to which one I shall go")
    where = step["where"]
    if where in _SPEAKERS:
        return [("navigate_to", {"place": "here"})]
    if where == "back":
        return [_back(spoken.request)]
    place = re.sub(r" with (?:it|them|that|this)$", "", spoken.spoken(step, "where"))
    return building.go({"place": place}, spoken.request)


def _back(request: Request) -> Skill:
    """Return the way to where the robot stood when it got the command before."""
    poses = [one.here for one in request.conversation.turns if one.here is not None]
    if not poses:
        raise UnknownPlace("back", set(request.world.places.values()))
    x_m, y_m, yaw_rad = (round(value, 3) for value in poses[-1])
    return "navigate_to", {"x_m": x_m, "y_m": y_m, "yaw_rad": yaw_rad}


def _pick(spoken: Spoken, step: Step) -> list[Skill]:
    way, things = spoken.things(step)
    return way + building.pick({"object": things, **_arm(step)}, spoken.request)


def _put(spoken: Spoken, step: Step) -> list[Skill]:
    relation = step.get("how", "to")
    if relation not in _CAN_PUT:
        raise CannotBeDone(f"I can put things in, on or next to something, not {relation} it")
    way, things = spoken.things(step)
    if "where" not in step:
        down = placing.put_away if spoken.says("away") else _put_down
        return way + down({"object": things}, spoken.request)
    where = {"destination": spoken.spoken(step, "where")}
    where |= {} if relation == "to" else {"relation": relation}
    return way + [("place", {"object": one, **where}) for one in building.parts_of(things)]


def _put_down(groups: building.Groups, _: Request) -> list[Skill]:
    return [("place", {"object": one}) for one in building.parts_of(groups["object"])]


def _bring(spoken: Spoken, step: Step) -> list[Skill]:
    """Give each thing to who speaks, or take it to a place, where it is put down on what is there.

    Raises:
        UnknownPlace: it is to go to a person, of whom nobody knows where they are.
    """
    way, behind = spoken.source(step)
    things = [part + behind for part in spoken.parts(step)]
    if step.get("to", "me") in _SPEAKERS:
        return way + building.handed_over(things, spoken.request)
    to, world = spoken.spoken(step, "to"), spoken.request.world
    place = match_place(to, world.places)
    if place is None:
        raise UnknownPlace(to, set(world.places.values()))
    if place in world.furniture:
        return way + [("place", {"object": one, "destination": to}) for one in things]
    go: Skill = ("navigate_to", {"place": to})
    return way + [skill for one in things for skill in (("pick_up", {"object": one}), go)]


def _give(_spoken: Spoken, _step: Step) -> list[Skill]:
    return [("hand_over", {})]


def _find(spoken: Spoken, step: Step) -> list[Skill]:
    way, things = spoken.things(step)
    return way + building.find({"object": things}, spoken.request)


def _see(spoken: Spoken, step: Step) -> list[Skill]:
    """Look for what must be there for the steps behind it, unless it is seen already."""
    way, things = spoken.things(step)
    if all(building.is_seen(one, spoken.request) for one in building.parts_of(things)):
        return []
    return way + building.find({"object": things}, spoken.request)


def _where(spoken: Spoken, step: Step) -> list[Skill]:
    return answering.tell_or_find({"object": spoken.spoken(step, "what")}, spoken.request)


def _look(spoken: Spoken, step: Step) -> list[Skill]:
    if "way" in step:
        return [("look_at", {"direction": step["way"]})]
    if step.get("what", "me") in _SPEAKERS:
        return [("look_at", {"direction": "ahead"})]
    return [("look_at", {"object": spoken.spoken(step, "what")})]


def _move(spoken: Spoken, step: Step) -> list[Skill]:
    sign = -1.0 if step["way"] == "backward" else 1.0
    return [("move", {"distance_m": sign * spoken.amount(step, "m", DEFAULT_MOVE_M)})]


def _turn(spoken: Spoken, step: Step) -> list[Skill]:
    sign = -1.0 if step["way"] == "right" else 1.0
    default = math.pi if step["way"] == "around" else DEFAULT_TURN_RAD
    return [("turn", {"angle_rad": sign * spoken.amount(step, "rad", default)})]


def _arm(step: Step) -> dict[str, str]:
    return {"arm": step["arm"]} if "arm" in step else {}


def _pose(_spoken: Spoken, step: Step) -> list[Skill]:
    name = _POSES.get(step["name"], step["name"].replace(" ", "_"))
    return [("move_arm", {"pose": name, **_arm(step)})]


def _say(_spoken: Spoken, step: Step) -> list[Skill]:
    text = step["text"]
    return [("speak", {"text": f"{text[:1].upper()}{text[1:]}."})]


def _wait(spoken: Spoken, step: Step) -> list[Skill]:
    return [("wait", {"duration_s": spoken.amount(step, "s", DEFAULT_WAIT_S)})]


def _ask(spoken: Spoken, step: Step) -> list[Skill]:
    return _ANSWERS[step["about"]]({}, spoken.request)


def _tidy(spoken: Spoken, step: Step) -> list[Skill]:
    said = (("where", "place"), ("except", "except"))
    groups = {name: spoken.spoken(step, field) for field, name in said if field in step}
    return tidying.tidy(groups, spoken.request)


def _doing(_: building.Groups, request: Request) -> list[Skill]:
    turns = request.conversation.turns
    told = f"The last that I was told is: {turns[-1].said}." if turns else "I wait for a command."
    return [("speak", {"text": told})]


def _refused(error: type[Declined | CannotBeDone], why: str) -> Handler:
    def handle(_spoken: Spoken, _step: Step) -> list[Skill]:
        raise error(why)

    return handle


_ANSWERS: Final[Mapping[str, building.Builder]] = {
    "holding": answering.tell_hands,
    "seeing": answering.tell_sight,
    "place": answering.tell_place,
    "able": answering.tell_abilities,
    "doing": _doing,
}
_HANDLERS: Final[Mapping[str, Handler]] = {
    "go": _go,
    "pick": _pick,
    "put": _put,
    "bring": _bring,
    "give": _give,
    "find": _find,
    "see": _see,
    "where": _where,
    "look": _look,
    "move": _move,
    "turn": _turn,
    "open": lambda _, step: [("open_gripper", _arm(step))],
    "close": lambda _, step: [("close_gripper", _arm(step))],
    "pose": _pose,
    "say": _say,
    "wait": _wait,
    "stop": lambda _spoken, _step: [("stop", {})],
    "ask": _ask,
    "tidy": _tidy,
    "await": lambda _spoken, _step: [],
    "forbid": _refused(CannotBeDone, "say by itself what I shall not do from now on"),
    "permit": _refused(CannotBeDone, "say by itself what I may do again"),
    "nothing": _refused(CannotBeDone, "it says what not to do, so I leave it"),
    "impossible": _refused(
        CannotBeDone,
        "none of my skills does that, but I can look for things, bring them and put them away",
    ),
    "unknown": _refused(Declined, "it is no command that I know"),
}
