"""Build the steps of each kind of clause; what they refer to stays in the speaker's words.

Grounding resolves the words and puts in the way there, so a step says only what is wanted.
"""

import re
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Final

from vla_deploy.planning.catalogue import ARMS
from vla_deploy.planning.errors import NotUnderstood, UnknownObject
from vla_deploy.planning.interfaces import Request
from vla_deploy.planning.plan import Action, Priority
from vla_deploy.planning.references import match_place, words_of
from vla_deploy.planning.understanding.expressions import read_expression
from vla_deploy.planning.understanding.fitting import Use, fitting
from vla_deploy.planning.understanding.places import is_like_place
from vla_deploy.planning.understanding.quantities import quantity_of
from vla_deploy.planning.understanding.referring import pose_parameters
from vla_deploy.planning.understanding.setting import Setting

Groups = Mapping[str, str]
Step = tuple[str, dict[str, Any]]
Builder = Callable[[Groups, Request], list[Step]]

SLOW_RATIO: Final = 0.4
# "Go back" alone is about the command before; in a longer one it is about where that began.
MOST_WORDS_ALONE: Final = 4
_NEAR: Final = re.compile(
    r"^(?:near|next to|close to|beside|by|up to|over to|towards?|in front of|at|to) "
)
PUT_GROUPS: Final = ("object", "relation", "destination")
BESIDE_WORDS: Final = ("next to", "beside", "alongside", "close to", "near")
BESIDE: Final = "|".join(BESIDE_WORDS)
WAYS: Final = "back|over|up|down|through|across|along|round|out"
_PUT_RELATION: Final = re.compile(
    rf"(?:^| )(?:(?:{WAYS}) )?"
    r"(?:into|inside of|inside|in|onto|on top of|on|to|at|over to|upon) "
)
_PUT_BESIDE: Final = re.compile(rf"{_PUT_RELATION.pattern}|(?:^| )(?:{BESIDE}) ")
# "On the table next to the book": there the book is.
_BESIDE_THERE: Final = re.compile(
    rf"(?P<moved>.+?) (?P<there>(?:on|onto|in) .+?) (?P<how>{BESIDE}) (?P<other>.+)"
)
NO_THING: Final = re.compile(
    r"^(?:the |my |your )?(?:far |very )?(?:left|right|middle)$|\b(?:is|are|that|which|farthest|"
    r"furthest|nearest|closest|not|lying|standing|sitting|resting)$"
)
_AND: Final = re.compile(r"\s*(?:,\s*and|,|\band\b)\s*")


def chained(
    steps: Sequence[Step], priorities: Sequence[Priority] | None = None
) -> tuple[Action, ...]:
    """Return the actions of steps, one after the other; each of medium priority by default."""
    ranks = priorities or [Priority.MEDIUM] * len(steps)
    return tuple(
        Action(
            id=f"a{number}",
            skill=skill,
            parameters=dict(parameters),
            depends_on=(f"a{number - 1}",) if number > 1 else (),
            priority=rank,
        )
        for number, ((skill, parameters), rank) in enumerate(zip(steps, ranks, strict=True), 1)
    )


def parts_of(text: str) -> list[str]:
    """Return the things of "the cup, the ball and the book"."""
    return [part for part in _AND.split(text) if part]


def held_kinds(request: Request) -> list[str]:
    """Return the kind of what each full hand holds."""
    return [kind for kind in request.world.holding.values() if kind]


def go(groups: Groups, request: Request) -> list[Step]:
    """Drive to each place or thing in turn; "near the box" is where the box can be reached."""
    named = (_NEAR.sub("", part) for part in parts_of(groups["place"]))
    speed = speed_in(groups, request)
    return [("navigate_to", {"place": part, **speed}) for part in named]


def approach(groups: Groups, request: Request) -> list[Step]:
    """Drive to where a thing can be reached."""
    return go({"place": groups["object"]}, request)


def dock(_: Groups, __: Request) -> list[Step]:
    """Drive to where the battery is charged."""
    return [("navigate_to", {"place": "charging station"})]


def come(_: Groups, __: Request) -> list[Step]:
    """Drive to where the command was given."""
    return [("navigate_to", {"place": "here"})]


def go_back(_: Groups, request: Request) -> list[Step]:
    """Return to where the command was given, or, as a command of its own, the one before it."""
    if len(words_of(request.text)) > MOST_WORDS_ALONE:
        return [("navigate_to", {"place": "here"})]
    before = [one.here for one in request.conversation.turns if one.here is not None]
    if not before:
        raise NotUnderstood(request.text)
    return [("navigate_to", pose_parameters(before[-1]))]


def pick(groups: Groups, _: Request) -> list[Step]:
    """Take each thing."""
    arm = arm_in(groups)
    return [("pick_up", {"object": part, **arm}) for part in parts_of(groups["object"])]


def split_put(groups: Groups, request: Request) -> tuple[str, str, str]:
    """Return what is put, how, and where to: "the cup on the table | into | the box".

    Of several ways to read it the last is meant of which both sides are known.
    """
    text = " ".join(groups[name] for name in PUT_GROUPS)
    beside = groups["relation"] in BESIDE_WORDS
    ways = [
        (text[: found.start()].strip(), found[0].strip(), text[found.end() :].strip())
        for found in (_PUT_BESIDE if beside else _PUT_RELATION).finditer(text)
        if text[: found.start()].strip() and text[found.end() :].strip()
    ]
    if beside and (told := _BESIDE_THERE.fullmatch(text)):
        there = f"{told['other']} {told['there']}"
        ways.append((told["moved"], told["how"], re.sub(r" (?:on|in)to ", " on ", there)))
    known = [
        way
        for way in ways
        if all(is_one(part, request) for part in parts_of(way[0])) and is_one(way[2], request)
    ]
    seen = [way for way in known if all(is_seen(part, request) for part in parts_of(way[0]))]
    return (seen or known or ways[:1] or [(text, "on", "")])[-1]


def is_seen(text: str, request: Request) -> bool:
    """Tell whether something in the scene fits what shall be put."""
    setting = Setting(request)
    try:
        read = read_expression(text, setting.furniture)
    except UnknownObject:  # a place
        return False
    return bool(read.pronoun or fitting(read, Use.PUT, setting))


def is_one(text: str, request: Request) -> bool:
    """Tell whether a text is the name of a place or refers to things that the robot can know.

    A side alone is neither, nor is what breaks off: "the cup that is".
    """
    if NO_THING.search(text):
        return False
    if is_like_place(_NEAR.sub("", text), request.world.places):
        return True
    try:
        read_expression(_NEAR.sub("", text), Setting(request).furniture)
    except UnknownObject:
        return False
    return True


def bring(groups: Groups, request: Request) -> list[Step]:
    """Fetch each thing and give it to who asked."""
    return handed_over(parts_of(groups["object"]), request)


def handed_over(things: Sequence[str], request: Request) -> list[Step]:
    """Return the steps that give things to who asked; grounding puts in the ways there and back.

    Two are fetched on one way, a hand each.
    """
    give: list[Step] = [("hand_over", {"object": one}) for one in things]
    if len(things) != len(ARMS) or request.here is None:
        return give
    fetch: list[Step] = [("pick_up", {"object": one}) for one in things]
    return [*fetch, ("navigate_to", {"place": "here"}), *give]


def find(groups: Groups, _: Request) -> list[Step]:
    """Look for each thing, first at a place if one is said."""
    there: list[Step] = [("navigate_to", {"place": groups["place"]})] if "place" in groups else []
    return there + [("find_object", {"object": part}) for part in parts_of(groups["object"])]


def look(groups: Groups, request: Request) -> list[Step]:
    """Turn the head to a direction or a thing; "down at the table" is down."""
    direction = _DIRECTIONS.get(re.sub(r"^(?:over )?(?:to )?(?:the |your )?", "", groups["what"]))
    if direction is None and "side" in groups and match_place(groups["what"], _furniture(request)):
        direction = _DIRECTIONS[groups["side"]]
    if direction is not None:
        return [("look_at", {"direction": direction})]
    return [("look_at", {"object": groups["what"]})]


def _furniture(request: Request) -> Mapping[str, str]:
    """Return what furniture may be called, by its whole name or what kind of furniture it is."""
    named = Setting(request).furniture
    return {name.split()[-1]: place for name, place in named.items()} | named


def look_around(groups: Groups, _: Request) -> list[Step]:
    """Look to all sides, at a place if one is said."""
    there: list[Step] = [("navigate_to", {"place": groups["place"]})] if "place" in groups else []
    return there + [("look_at", {"direction": side}) for side in ("left", "ahead", "right", "down")]


def gripper(groups: Groups, _: Request) -> list[Step]:
    """Open or close a hand."""
    verb = "close" if groups["verb"] in ("close", "shut") else "open"
    return [(f"{verb}_gripper", arm_in(groups))]


def tuck(groups: Groups, _: Request) -> list[Step]:
    """Fold the arms in for driving."""
    return [("move_arm", {"pose": "tuck", **arm_in(groups)})]


def speak(groups: Groups, _: Request) -> list[Step]:
    """Say something."""
    return [("speak", {"text": groups["text"].strip("\"'")})]


def wait(groups: Groups, _: Request) -> list[Step]:
    """Do nothing for a while."""
    return [("wait", {"duration_s": quantity_in(groups, "s", 2.0)})]


def stop(_: Groups, __: Request) -> list[Step]:
    """Come to rest."""
    return [("stop", {})]


def quantity_in(groups: Groups, dimension: str, default: float) -> float:
    """Return how much was said, in SI units of a dimension.

    Raises:
        NotUnderstood: that is no quantity.
    """
    if "quantity" not in groups:
        return default
    value = quantity_of(groups["quantity"], dimension)
    if value is None:
        raise NotUnderstood(groups["quantity"])
    return value


def speed_in(groups: Groups, request: Request) -> dict[str, Any]:
    """Return how fast to drive, where it is said: "slowly", "at 0.2 m/s"."""
    most_m_s = request.world.max_speed_m_s
    if "speed" in groups:
        return {"speed_m_s": quantity_of(groups["speed"], "m_s")}
    return {"speed_m_s": SLOW_RATIO * most_m_s} if "pace" in groups and most_m_s else {}


def arm_in(groups: Groups) -> dict[str, Any]:
    """Return which hand to take, where it is said."""
    return {"arm": groups["arm"]} if groups.get("arm") in ("left", "right") else {}


_DIRECTIONS: Final = {
    "ahead": "ahead", "forward": "ahead", "forwards": "ahead", "straight": "ahead",
    "straight ahead": "ahead", "left": "left", "right": "right", "up": "up", "down": "down",
    "ceiling": "up", "floor": "down", "ground": "down",
}  # fmt: skip
