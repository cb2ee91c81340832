"""Answer questions about the robot itself, from what it knows."""

import math
from collections.abc import Callable, Mapping
from typing import Final

from vla_deploy.planning.asking import Request

_MOST_NAMED: Final = 8
_NEAR_M: Final = 1.0


def own_answer(about: str, request: Request) -> str:
    """Return a sentence about one of the subjects of the grammar."""
    return _ANSWERS[about](request)


def _holding(request: Request) -> str:
    held = [f"a {kind} in my {hand} hand" for hand, kind in request.world.holding.items() if kind]
    return f"I hold {' and '.join(held)}." if held else "I hold nothing."


def _seeing(request: Request) -> str:
    if request.scene is None or not request.scene.things:
        return "I see nothing that I know."
    named = [f"a {thing.colour} {thing.kind}".replace("  ", " ") for thing in request.scene.things]
    return f"I know of {', '.join(named[:_MOST_NAMED])}."


def _place(request: Request) -> str:
    if request.here is None or not request.world.sites:
        return "I do not know where I am."
    x_m, y_m, _ = request.here
    distances = {
        name: math.dist((x_m, y_m), (site.pose.x_m, site.pose.y_m))
        for name, site in request.world.sites.items()
    }
    nearest = min(distances, key=lambda name: distances[name])
    words = nearest.replace("_", " ")
    return f"I am {'at' if distances[nearest] < _NEAR_M else 'not far from'} the {words}."


def _doing(request: Request) -> str:
    turns = request.conversation.turns
    return f"The last that I was told is: {turns[-1].said}." if turns else "I wait for a command."


def _able(_request: Request) -> str:
    return (
        "I can go to a place, find things, pick them up, put them in or on something, bring them, "
        "look, turn, move, wait and speak."
    )


_ANSWERS: Final[Mapping[str, Callable[[Request], str]]] = {
    "holding": _holding,
    "seeing": _seeing,
    "place": _place,
    "doing": _doing,
    "able": _able,
}
