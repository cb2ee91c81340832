"""Build actions of the steps that a pattern, or the command parser, has made of a command.

A step is what to `do`, with fields in the speaker's words (`command_parser.grammar`). What they
refer to stays in these words: grounding resolves it and puts in ways, searches and free hands, for
every planner alike (`vla_deploy.planning.understanding`).
"""

import math
import re
from collections.abc import Callable, Mapping, Sequence
from typing import Final

from vla_deploy.planning.builders import answering
from vla_deploy.planning.builders.tidying import STORE, look_around, tidy
from vla_deploy.planning.command_parser.grammar import CHARGING, Step
from vla_deploy.planning.command_parser.wording import find_span
from vla_deploy.planning.errors import CannotBeDone, Declined, NotAble
from vla_deploy.planning.interfaces import PlanRequest
from vla_deploy.planning.patterns.phrase import parts_of
from vla_deploy.planning.understanding.fitting import CommandContext, ThingUse, fitting
from vla_deploy.planning.understanding.places import pose_parameters
from vla_deploy.planning.understanding.quantities import UNITS, amount_of, quantity_words
from vla_deploy.plans.errors import PlanInvalid, UnknownObject, UnknownPlace
from vla_deploy.plans.knowledge import match_devices, match_place
from vla_deploy.plans.plan import Skill
from vla_deploy.plans.table_setting import DEFAULT, set_table
from vla_deploy.world.relations import NEXT_TO
from vla_deploy.world.vocabulary import CONTAINERS, SYNONYMS

DEFAULT_MOVE_M: Final = 0.5
DEFAULT_TURN_RAD: Final = math.pi / 2
DEFAULT_WAIT_S: Final = 5.0
# "Go back" alone is about the command before; in a longer one it is about where that began.
MOST_WORDS_ALONE: Final = 4
_SPEAKERS: Final = frozenset({"me", "us", "here", "over here"})
# Words for the same pose; which of them a robot's own is called, its file says.
_SAME_POSE: Final = (
    frozenset({"tuck", "tucked", "fold", "folded", "stow", "pull"}),
    frozenset({"rest", "resting", "relax", "lower"}),
)
_DIRECTIONS: Final = {"straight ahead": "ahead", "floor": "down", "ceiling": "up"}
_RELATIONS: Final[Mapping[str, str]] = {
    "in": "in", "into": "in", "inside": "in", "on": "on", "onto": "on", "on top of": "on",
    "next to": NEXT_TO, "beside": NEXT_TO, "near": NEXT_TO,
}  # fmt: skip
_NEAR: Final = re.compile(
    r"^(?:near|next to|close to|beside|by|up to|over to|towards?|in front of|at|to) "
)
# What was copied beside a thing: "(get) a grip of (the red book)", "(what became) of the phone".
_BESIDE: Final = re.compile(r"^(?:(?:an? )?(?:grip|hold|grasp|ahold|rid) )?(?:of|about) ")
Handler = Callable[["Steps", Step], list[Skill]]


class Steps:
    """Hold the words of a command, and make actions of the steps that answer it."""

    def __init__(self, command: Sequence[str], request: PlanRequest) -> None:
        self.command = command
        self.request = request

    def skills(self, step: Step) -> list[Skill]:
        """Return the skills of a step with their parameters, one after the other.

        Raises:
            Declined: it is no command.
            CannotBeDone: no skill does what it asks for.
            UnknownPlace: it goes to a person, or back to where nobody knows.
            PlanInvalid: an amount is none.
        """
        return _HANDLERS[step["do"]](self, step)

    def spoken(self, step: Step, field: str) -> str:
        """Return the words of a field, with the articles that were said among them."""
        words = step[field].split()
        span = find_span(words, self.command)
        return _BESIDE.sub("", " ".join(words if span is None else span.spoken))

    def fields(self, step: Step, *names: str) -> dict[str, str]:
        """Return the words of those of some fields that a step has."""
        return {name: self.spoken(step, name) for name in names if name in step}

    def things(self, step: Step) -> tuple[list[Skill], list[str]]:
        """Return the way to what a step is about, and that, with where it is to be taken from."""
        what, _, inner = self._chosen(step).partition(" from ")
        parts = parts_of(what)
        if "except" in step:
            parts = [f"{what} but {self.spoken(step, 'except')}"]
        where = self.spoken(step, "from") if "from" in step else inner
        if not where:
            return [], parts
        place = match_place(where, self.request.world.places)
        is_room = place is not None and not self.request.world.is_surface(place)
        kinds = {SYNONYMS.get(word, word) for word in where.split()}
        relation = "in" if is_room or kinds & CONTAINERS else "on"
        there = [f"{part} {relation} {where}" for part in parts]
        if is_room and not all(is_seen(one, self.request) for one in there):
            return [("navigate_to", {"place": place})], parts
        return [], there

    def _chosen(self, step: Step) -> str:
        """Return what a step is about: of two choices the second where only that is seen."""
        first = self.spoken(step, "what")
        second = self.spoken(step, "else") if "else" in step else ""
        is_second = bool(second) and not is_seen(first, self.request)
        return second if is_second and is_seen(second, self.request) else first

    def amount(self, step: Step, dimension: str, default: float) -> float:
        """Return the amount of a step in SI units; a bare number is one of degrees, not radians.

        Raises:
            PlanInvalid: its words are no amount.
        """
        words = quantity_words(step["by"]) if "by" in step else []
        if not words:
            return default
        units = UNITS[dimension]
        value = amount_of(words, units, units["degree"] if dimension == "rad" else 1.0)
        if value is None:
            raise PlanInvalid([f'"{step["by"]}" is no amount that I know'])
        return value

    def time(self, step: Step) -> dict[str, float]:
        """Return how long a step says that it shall take, nothing where it does not."""
        return {"duration_s": self.amount(step, "s", DEFAULT_WAIT_S)} if "by" in step else {}


def is_seen(text: str, request: PlanRequest) -> bool:
    """Return whether something in the scene fits what shall be put."""
    context = CommandContext(request)
    try:
        read = context.read(text)
    except UnknownObject:  # a place
        return False
    return bool(read.pronoun or fitting(read, ThingUse.PUT, context))


def way_back(request: PlanRequest) -> Skill:
    """Return the way to where the robot stood when it got the command before.

    Raises:
        UnknownPlace: there is none before.
    """
    poses = [one.here for one in request.conversation.turns if one.here is not None]
    if not poses:
        raise UnknownPlace("back", set(request.world.places.values()))
    return "navigate_to", pose_parameters(poses[-1])


def _switch(spoken: Steps, step: Step) -> list[Skill]:
    named = (match_devices(one, spoken.request.world) for one in parts_of(step["device"]))
    return [(f"turn_{step['way']}", {"device": one}) for each in named for one in each]


def _go(spoken: Steps, step: Step) -> list[Skill]:
    if "else" in step:
        raise CannotBeDone("every place that I know is there: say to which one I shall go")
    where = step["where"]
    if where == "back" and len(spoken.request.text.split()) <= MOST_WORDS_ALONE:
        return [way_back(spoken.request)]
    if where == "back" or where in _SPEAKERS:
        return [("navigate_to", {"place": "here"})]
    places = re.sub(r" with (?:it|them|that|this)$", "", spoken.spoken(step, "where"))
    return [_way_to(_NEAR.sub("", one), spoken.request) for one in parts_of(places)]


def _way_to(place: str, request: PlanRequest) -> Skill:
    """Return the way to a place; at the charging station the robot charges."""
    station = request.world.station
    if station and (place == CHARGING or match_place(place, request.world.places) == station):
        return "charge", {}
    return "navigate_to", {"place": place}


def _pick(spoken: Steps, step: Step) -> list[Skill]:
    way, things = spoken.things(step)
    return way + [("pick_up", {"object": one, **_arm(step)}) for one in things]


def _put(spoken: Steps, step: Step) -> list[Skill]:
    relation = step.get("how", "to")
    if relation != "to" and relation not in _RELATIONS:
        raise CannotBeDone(f"I can put things in, on or next to something, not {relation} it")
    if step.get("where") == "back":
        raise NotAble("I do not remember where it was: say where I shall put it")
    way, things = spoken.things(step) if "what" in step else ([], [""])
    arm = _arm(step)
    if "where" not in step:
        where = {"destination": STORE, "relation": "in"} if "away" in spoken.command else {}
    else:
        where = {"destination": spoken.spoken(step, "where")}
        where |= {} if relation == "to" else {"relation": _RELATIONS[relation]}
        bare = match_place(where["destination"], spoken.request.world.places)
        if relation == "to" and bare and bare not in spoken.request.world.furniture:
            go: Skill = ("navigate_to", {"place": where["destination"]})
            return way + [one for it in things for one in (("pick_up", {"object": it}), go)]
    return way + [("place", {**({"object": one} if one else {}), **where, **arm}) for one in things]


def _bring(spoken: Steps, step: Step) -> list[Skill]:
    """Give each thing to who speaks, or take it to a place.

    Raises:
        UnknownPlace: it is to go to a person, of whom nobody knows where they are.
    """
    if step.get("to", "me") not in _SPEAKERS:
        places = spoken.request.world.places
        if match_place(step["to"], places) is None:
            raise UnknownPlace(spoken.spoken(step, "to"), set(places.values()))
        return _put(spoken, {**step, "where": step["to"]})
    way, things = spoken.things(step)
    return way + [("hand_over", {"object": one}) for one in things]


def _find(spoken: Steps, step: Step) -> list[Skill]:
    way, things = spoken.things(step)
    return way + [("find_object", {"object": one}) for one in things]


def _see(spoken: Steps, step: Step) -> list[Skill]:
    """Look for what must be there for the steps behind it, unless it is seen already."""
    _, things = spoken.things(step)
    return [] if all(is_seen(one, spoken.request) for one in things) else _find(spoken, step)


def _look(spoken: Steps, step: Step) -> list[Skill]:
    if step.get("way") == "around":
        return look_around()
    if "way" in step:
        return [("look_at", {"direction": _DIRECTIONS.get(step["way"], step["way"])})]
    if step.get("what", "me") in _SPEAKERS:
        return [("look_at", {"direction": "ahead"})]
    return [("look_at", {"object": spoken.spoken(step, "what")})]


def _move(spoken: Steps, step: Step) -> list[Skill]:
    sign = -1.0 if step["way"].startswith("back") else 1.0
    return [("move", {"distance_m": sign * spoken.amount(step, "m", DEFAULT_MOVE_M)})]


def _turn(spoken: Steps, step: Step) -> list[Skill]:
    way = step.get("way", "left")
    default = math.pi if way in ("around", "round") else DEFAULT_TURN_RAD
    sign = -1.0 if way == "right" else 1.0
    return [("turn", {"angle_rad": sign * spoken.amount(step, "rad", default)})]


def _arm(step: Step) -> dict[str, str]:
    return {"arm": step["arm"]} if "arm" in step else {}


def pose_named(words: str, poses: frozenset[str]) -> str | None:
    """Return the pose that words mean: it, or one of another word for the same."""
    said = words.replace(" ", "_")
    same = next((words for words in _SAME_POSE if said in words), frozenset())
    return said if said in poses else next(iter(sorted(same & poses)), None)


def _pose(spoken: Steps, step: Step) -> list[Skill]:
    said = step["name"]
    name = pose_named(said, spoken.request.world.poses) or said.replace(" ", "_")
    return [("move_arm", {"pose": name, **_arm(step)})]


def _say(_spoken: Steps, step: Step) -> list[Skill]:
    text = step["text"].strip("\"'")
    return [("speak", {"text": f"{text[:1].upper()}{text[1:]}."})]


def _answer(spoken: Steps, step: Step) -> list[Skill]:
    tell = answering.ANSWERS[step["about"]]
    return tell(spoken.fields(step, "what", "where", "device"), spoken.request)


def _refused(error: type[Declined | CannotBeDone], why: str) -> Handler:
    def handle(_spoken: Steps, _step: Step) -> list[Skill]:
        raise error(why)

    return handle


_HANDLERS: Final[Mapping[str, Handler]] = {
    "go": _go,
    "pick": _pick,
    "put": _put,
    "bring": _bring,
    "give": lambda _spoken, _step: [("hand_over", {})],
    "find": _find,
    "see": _see,
    "where": lambda spoken, step: answering.tell_or_find(
        spoken.fields(step, "what"), spoken.request
    ),
    "look": _look,
    "move": _move,
    "turn": _turn,
    "open": lambda _, step: [("open_gripper", _arm(step))],
    "close": lambda _, step: [("close_gripper", _arm(step))],
    "pose": _pose,
    "switch": _switch,
    "say": _say,
    "wait": lambda spoken, step: [("wait", {"duration_s": DEFAULT_WAIT_S, **spoken.time(step)})],
    "stop": lambda _spoken, _step: [("stop", {})],
    "follow": lambda spoken, step: [("follow_person", spoken.time(step))],
    "inspect": lambda spoken, step: [("inspect", {"object": spoken.spoken(step, "what")})],
    "guard": lambda spoken, step: [
        ("guard", {**({"place": step["where"]} if "where" in step else {}), **spoken.time(step)})
    ],
    "ask": _answer,
    "tidy": lambda spoken, step: tidy(spoken.fields(step, "where", "except"), spoken.request),
    "patrol": lambda _spoken, step: [
        one for name in ("where", "then") if name in step for one in look_around(step[name])
    ],
    "set": lambda spoken, step: set_table(
        step.get("where", "the table"),
        step.get("by", DEFAULT),
        spoken.request.world,
        spoken.request.scene,
    ),
    "sweep": lambda _spoken, step: [("sweep", {"place": step["where"]})],
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
