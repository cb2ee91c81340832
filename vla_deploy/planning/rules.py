"""Plan the common commands by rules: a table of patterns, each with its actions.

This is the planner that is always there: no model, no network, the same answer every time.
"""

import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from vla_deploy.planning.catalogue import SKILLS
from vla_deploy.planning.errors import NotUnderstood, UnknownObject, UnknownPlace
from vla_deploy.planning.knowledge import World
from vla_deploy.planning.plan import Action, Plan
from vla_deploy.planning.references import ObjectQuery, match_place, parse_object, words_of

Step = tuple[str, dict[str, object]]
STOP_WORDS = frozenset(
    {"stop", "halt", "freeze", "cancel", "abort", "stop now", "stop it", "stop that", "never mind"}
)
PRONOUNS = frozenset({"it", "that", "this", "them", "one"})
_POLITE = re.compile(
    r"^(please|could you|can you|would you|robot|butler|hey butler|i want you to)[, ]+"
    r"|[, ]*please$|[.!?]+$"
)
_SPLIT = re.compile(r"\s*(?:,?\s*\b(?:and then|then|and)\b|[,;])\s*")
_NUMBER_WORDS = {
    "a": 1.0,
    "one": 1.0,
    "two": 2.0,
    "three": 3.0,
    "half": 0.5,
    "five": 5.0,
    "ten": 10.0,
}
_NUMBER = r"(?P<number>\d+(?:\.\d+)?|half|a|one|two|three|five|ten)(?: an?)?"


@dataclass(slots=True)
class Conversation:
    """Carry what earlier clauses of one command established."""

    world: World
    mentioned: ObjectQuery | None = None
    in_hand: ObjectQuery | None = None
    return_pose: tuple[float, float, float] | None = None


def is_stop(text: str) -> bool:
    """Tell whether a command means: stop what you are doing."""
    return " ".join(words_of(_polite(text))) in STOP_WORDS


def plan_command(text: str, world: World, here: tuple[float, float, float] | None = None) -> Plan:
    """Plan one command; `here` is the robot's x, y, yaw in the map, to which "bring me" returns.

    Raises:
        NotUnderstood: no rule covers a clause.
        UnknownPlace: a clause names a place that the robot file lacks.
        UnknownObject: a clause names an object the robot cannot recognise.
    """
    talk = Conversation(world, return_pose=here)
    clauses = _clauses(_polite(text))
    if not clauses:
        raise NotUnderstood(text)
    steps = [step for clause in clauses for step in _plan_clause(clause, talk)]
    return Plan(goal=text.strip(), summary=_summary(steps), actions=_chain(steps))


def _polite(text: str) -> str:
    text = " ".join(text.lower().split())
    while (shorter := _POLITE.sub("", text).strip()) != text:
        text = shorter
    return text


def _clauses(text: str) -> list[str]:
    return [clause for clause in _SPLIT.split(text) if clause]


def _plan_clause(clause: str, talk: Conversation) -> list[Step]:
    for pattern, build in RULES:
        found = pattern.fullmatch(clause)
        if found:
            groups = {key: value for key, value in found.groupdict().items() if value is not None}
            return build(groups, talk)
    raise NotUnderstood(clause)


def _chain(steps: list[Step]) -> tuple[Action, ...]:
    actions: list[Action] = []
    for number, (skill, parameters) in enumerate(steps, start=1):
        spec = SKILLS[skill]
        actions.append(
            Action(
                id=f"a{number}",
                skill=skill,
                parameters=parameters,
                depends_on=(f"a{number - 1}",) if number > 1 else (),
                resources=spec.resources,
                estimated_duration_s=spec.estimated_duration_s,
            )
        )
    return tuple(actions)


def _summary(steps: list[Step]) -> str:
    return ", ".join(
        " ".join([skill.replace("_", " "), *(str(value) for value in parameters.values())])
        for skill, parameters in steps
    )


def _object_of(text: str, talk: Conversation) -> ObjectQuery:
    if text.strip() in PRONOUNS and talk.mentioned:
        return talk.mentioned
    return parse_object(text)


def _reach(query: ObjectQuery) -> list[Step]:
    return [("find_object", {"object": str(query)}), ("navigate_to", {"object": str(query)})]


def _go(groups: Mapping[str, str], talk: Conversation) -> list[Step]:
    place = match_place(groups["place"], talk.world.places)
    if place:
        return [("navigate_to", {"place": place})]
    try:
        query = _object_of(groups["place"], talk)
    except UnknownObject as error:
        raise UnknownPlace(groups["place"], set(talk.world.places.values())) from error
    return _reach(query)


def _pick(groups: Mapping[str, str], talk: Conversation) -> list[Step]:
    query = _object_of(groups["object"], talk)
    talk.mentioned = talk.in_hand = query
    return [*_reach(query), ("pick_up", {"object": str(query)})]


def _put(groups: Mapping[str, str], talk: Conversation) -> list[Step]:
    relation = "in" if groups["relation"] in ("in", "into", "inside") else "on"
    destination = groups["destination"]
    held = talk.in_hand or any(talk.world.holding.values())
    steps: list[Step] = []
    if groups["object"] not in PRONOUNS or not held:
        query = _object_of(groups["object"], talk)
        if query != talk.in_hand:
            steps += _pick({"object": groups["object"]}, talk)
    place = match_place(destination, talk.world.places)
    if place:
        steps.append(("navigate_to", {"place": place}))
        steps.append(("place", {"destination": place, "relation": "on"}))
    else:
        query = parse_object(destination)
        steps += _reach(query)
        steps.append(("place", {"destination": str(query), "relation": relation}))
    talk.in_hand = None
    return steps


def _bring(groups: Mapping[str, str], talk: Conversation) -> list[Step]:
    steps = _pick(groups, talk)
    if talk.return_pose is not None:
        x_m, y_m, yaw_rad = (round(value, 3) for value in talk.return_pose)
        steps.append(("navigate_to", {"x_m": x_m, "y_m": y_m, "yaw_rad": yaw_rad}))
    return [*steps, ("speak", {"text": f"Here is the {talk.in_hand}."})]


def _find(groups: Mapping[str, str], talk: Conversation) -> list[Step]:
    talk.mentioned = _object_of(groups["object"], talk)
    return [("find_object", {"object": str(talk.mentioned)})]


def _look(groups: Mapping[str, str], talk: Conversation) -> list[Step]:
    direction = {"forward": "ahead", "straight": "ahead"}.get(groups["what"], groups["what"])
    if direction in ("ahead", "left", "right", "up", "down"):
        return [("look_at", {"direction": direction})]
    talk.mentioned = _object_of(groups["what"], talk)
    query = str(talk.mentioned)
    return [("find_object", {"object": query}), ("look_at", {"object": query})]


def _drive(groups: Mapping[str, str], _talk: Conversation) -> list[Step]:
    sign = -1.0 if groups["way"].startswith("back") else 1.0
    scale = 0.01 if groups.get("unit", "m").startswith("c") else 1.0
    return [("move", {"distance_m": sign * scale * _quantity(groups, default=0.5)})]


def _turn(groups: Mapping[str, str], _talk: Conversation) -> list[Step]:
    if groups["way"] == "around":
        return [("turn", {"angle_rad": math.pi})]
    sign = -1.0 if groups["way"] == "right" else 1.0
    return [("turn", {"angle_rad": sign * math.radians(_quantity(groups, default=90.0))})]


def _gripper(groups: Mapping[str, str], _talk: Conversation) -> list[Step]:
    parameters: dict[str, object] = {"arm": groups["arm"]} if "arm" in groups else {}
    return [(f"{groups['verb']}_gripper", parameters)]


def _speak(groups: Mapping[str, str], _talk: Conversation) -> list[Step]:
    return [("speak", {"text": groups["text"]})]


def _wait(groups: Mapping[str, str], _talk: Conversation) -> list[Step]:
    return [("wait", {"duration_s": _quantity(groups, default=1.0)})]


def _quantity(groups: Mapping[str, str], default: float) -> float:
    number = groups.get("number")
    if number is None:
        return default
    return _NUMBER_WORDS[number] if number in _NUMBER_WORDS else float(number)


Builder = Callable[[Mapping[str, str], Conversation], list[Step]]
_OBJECT = r"(?P<object>.+?)"
_UNIT = r" ?(?P<unit>m|meters?|metres?|cm|centimeters?|centimetres?)"

RULES: tuple[tuple[re.Pattern[str], Builder], ...] = tuple(
    (re.compile(pattern), build)
    for pattern, build in (
        (rf"(?:bring|fetch|get|give|hand) me {_OBJECT}", _bring),
        (rf"(?:bring|carry|take) {_OBJECT} (?:here|(?:back )?to me)", _bring),
        (rf"fetch {_OBJECT}", _bring),
        (
            rf"(?:put|place|drop|set|throw|lay|move|carry|bring) {_OBJECT} (?:down )?"
            r"(?P<relation>into|inside|in|onto|on|to) (?P<destination>.+)",
            _put,
        ),
        (
            r"(?:move|drive|go) (?P<way>forwards?|ahead|backwards?|back)"
            rf"(?: (?:by )?{_NUMBER}{_UNIT})?",
            _drive,
        ),
        (
            r"(?:turn|rotate) (?:to the )?(?P<way>left|right|around)"
            rf"(?: (?:by )?{_NUMBER} ?(?:degrees|deg|°))?",
            _turn,
        ),
        (r"(?:go|drive|come|move|navigate|return|walk|head)(?: back)? (?:to )?(?P<place>.+)", _go),
        (rf"(?:pick|lift)(?: up)? {_OBJECT}(?: up)?", _pick),
        (rf"(?:grab|take|grasp|get) {_OBJECT}", _pick),
        (rf"(?:find|search for|locate|look for|where is|where are) {_OBJECT}", _find),
        (r"look (?:at |to )?(?:the )?(?P<what>.+)", _look),
        (
            r"(?P<verb>open|close) (?:the |your )?(?:(?P<arm>left|right) )?(?:gripper|hand)",
            _gripper,
        ),
        (r"say (?P<text>.+)", _speak),
        (rf"wait(?: for)? {_NUMBER} ?(?:seconds?|s)", _wait),
    )
)
