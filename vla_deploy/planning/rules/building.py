"""Build the steps of each kind of clause; what they refer to stays in the speaker's words.

Grounding resolves the words and puts in the way there, so a step says only what is wanted.
"""

import math
import re
from collections.abc import Callable, Mapping
from typing import Any, Final

from vla_deploy.planning.asking import Request
from vla_deploy.planning.errors import NotUnderstood
from vla_deploy.planning.references import words_of
from vla_deploy.planning.understanding.phrases import PRONOUNS
from vla_deploy.planning.understanding.quantities import quantity_of

Groups = Mapping[str, str]
Step = tuple[str, dict[str, Any]]
Builder = Callable[[Groups, Request], list[Step]]

DRIVE_M: Final = 0.5
TURN_RAD: Final = math.pi / 2
# What "put it away" means where nothing else is said.
STORE: Final = "box"
_AND: Final = re.compile(r"\s*(?:,\s*and|,|\band\b)\s*")


def parts_of(text: str) -> list[str]:
    """Return the things of "the cup, the ball and the book"."""
    return [part for part in _AND.split(text) if part]


def go(groups: Groups, _: Request) -> list[Step]:
    """Drive to each place or thing in turn."""
    return [("navigate_to", {"place": part}) for part in parts_of(groups["place"])]


def pick(groups: Groups, _: Request) -> list[Step]:
    """Take each thing."""
    arm = _arm(groups)
    return [("pick_up", {"object": part, **arm}) for part in parts_of(groups["object"])]


def put(groups: Groups, _: Request) -> list[Step]:
    """Put each thing somewhere, fetching it first."""
    relation = "in" if groups["relation"].removeprefix("back ") in _INTO else "on"
    where = {"destination": groups["destination"], "relation": relation, **_arm(groups)}
    return [("place", {"object": part, **where}) for part in parts_of(groups["object"])]


def put_down(groups: Groups, _: Request) -> list[Step]:
    """Put down what is held."""
    return [("place", {"object": groups.get("object", "it"), **_arm(groups)})]


def put_away(groups: Groups, _: Request) -> list[Step]:
    """Put things into the box."""
    where = {"destination": STORE, "relation": "in"}
    return [("place", {"object": part, **where}) for part in parts_of(groups["object"])]


def bring(groups: Groups, request: Request) -> list[Step]:
    """Fetch a thing and return to where the command was given."""
    back: list[Step] = [("navigate_to", {"place": "here"})] if request.here is not None else []
    words = " ".join(words_of(groups["object"]))
    said = "Here you are." if words in PRONOUNS else f"Here is the {words}."
    return [*pick(groups, request), *back, ("speak", {"text": said})]


def find(groups: Groups, _: Request) -> list[Step]:
    """Look for each thing, first at a place if one is said."""
    there: list[Step] = [("navigate_to", {"place": groups["place"]})] if "place" in groups else []
    return there + [("find_object", {"object": part}) for part in parts_of(groups["object"])]


def look(groups: Groups, _: Request) -> list[Step]:
    """Turn the head to a direction or a thing."""
    direction = _DIRECTIONS.get(groups["what"].removeprefix("to the ").removeprefix("the "))
    if direction is not None:
        return [("look_at", {"direction": direction})]
    return [("look_at", {"object": groups["what"]})]


def look_around(groups: Groups, _: Request) -> list[Step]:
    """Look to all sides, at a place if one is said."""
    there: list[Step] = [("navigate_to", {"place": groups["place"]})] if "place" in groups else []
    return there + [("look_at", {"direction": side}) for side in ("left", "ahead", "right", "down")]


def drive(groups: Groups, _: Request) -> list[Step]:
    """Drive straight."""
    sign = -1.0 if groups["way"].startswith(("back", "reverse")) else 1.0
    return [("move", {"distance_m": sign * _quantity(groups, "m", DRIVE_M)})]


def turn(groups: Groups, _: Request) -> list[Step]:
    """Turn on the spot."""
    way = groups.get("way", "around")
    default = math.pi if way == "around" else TURN_RAD
    sign = -1.0 if way in ("right", "clockwise") else 1.0
    return [("turn", {"angle_rad": sign * _quantity(groups, "rad", default)})]


def gripper(groups: Groups, _: Request) -> list[Step]:
    """Open or close a hand."""
    verb = "close" if groups["verb"] in ("close", "shut") else "open"
    return [(f"{verb}_gripper", _arm(groups))]


def pose(groups: Groups, request: Request) -> list[Step]:
    """Bring the arms to a named pose."""
    words = groups["pose"].strip().replace(" ", "_")
    if words not in request.world.poses:
        raise NotUnderstood(" ".join(groups.values()))
    return [("move_arm", {"pose": words, **_arm(groups)})]


def tuck(groups: Groups, _: Request) -> list[Step]:
    """Fold the arms in for driving."""
    return [("move_arm", {"pose": "tuck", **_arm(groups)})]


def hold(_: Groups, __: Request) -> list[Step]:
    """Take what a person gives: open, ask, wait, close."""
    return [
        ("open_gripper", {}),
        ("speak", {"text": "Put it between my fingers."}),
        ("wait", {"duration_s": 4.0}),
        ("close_gripper", {}),
    ]


def speak(groups: Groups, _: Request) -> list[Step]:
    """Say something."""
    return [("speak", {"text": groups["text"].strip("\"'")})]


def wait(groups: Groups, _: Request) -> list[Step]:
    """Do nothing for a while."""
    return [("wait", {"duration_s": _quantity(groups, "s", 2.0)})]


def stop(_: Groups, __: Request) -> list[Step]:
    """Come to rest."""
    return [("stop", {})]


def _quantity(groups: Groups, dimension: str, default: float) -> float:
    if "quantity" not in groups:
        return default
    value = quantity_of(groups["quantity"], dimension)
    if value is None:
        raise NotUnderstood(groups["quantity"])
    return value


def _arm(groups: Groups) -> dict[str, Any]:
    return {"arm": groups["arm"]} if groups.get("arm") in ("left", "right") else {}


_INTO: Final = frozenset({"in", "into", "inside", "inside of"})
_DIRECTIONS: Final = {
    "ahead": "ahead", "forward": "ahead", "forwards": "ahead", "straight": "ahead",
    "straight ahead": "ahead", "left": "left", "right": "right", "up": "up", "down": "down",
    "ceiling": "up", "floor": "down", "ground": "down",
}  # fmt: skip
