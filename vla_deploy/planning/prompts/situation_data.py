"""Write a situation as data for a model: rows of quoted, bounded texts, what matters most first.

No text in it can end the data, and rows are left out by one written order where there is no room.
"""

import json
import math
import unicodedata
from collections.abc import Iterator, Mapping
from typing import Any, Final

from vla_deploy.planning.interfaces import Request
from vla_deploy.planning.understanding import Turn
from vla_deploy.world import Snapshot, Thing, Viewpoint
from vla_deploy.world.words import size_word

NAME_CHARACTERS: Final = 60
SENTENCE_CHARACTERS: Final = 200
_LOOKED_AT: Final = 4  # times as much as may be left when white space is folded
# What could end the data is written as an escape of JSON.
_ESCAPES: Final = {ord("<"): "\\u003c", ord(">"): "\\u003e", ord("&"): "\\u0026"}
# What is cut first, and how many rows of it are kept while anything after it can be cut. The first
# rows matter most: things that the command names, then the nearest; what was said last.
CUT_ORDER: Final[tuple[tuple[str, int], ...]] = (
    ("remembered", 0),
    ("gone", 0),
    ("things", 12),
    ("said_before", 1),
    ("failed_before", 1),
    ("things", 0),
    ("said_before", 0),
    ("failed_before", 0),
)
_COMMA: Final = 1
MOST_THINGS: Final = 60
MOST_RECOLLECTIONS: Final = 8
_UNKNOWN_KIND: Final = "object"


def situation_of(request: Request) -> dict[str, Any]:
    """Return all that a planner should know of a request, apart from the command itself."""
    scene = request.scene
    things = [] if scene is None else _things(request, scene)
    gone = [] if scene is None else [plain(one.thing) for one in scene.lost]
    return {
        "things": things,
        "left_out": 0 if scene is None else len(scene.things) - len(things),
        "gone": gone,
        "hands": {plain(hand): _held(what) for hand, what in request.world.holding.items()},
        "places": sorted({plain(place) for place in request.world.places.values()}),
        "said_before": [_turn(one) for one in reversed(request.conversation.turns)],
        "remembered": [
            plain(one, SENTENCE_CHARACTERS) for one in request.recollections[:MOST_RECOLLECTIONS]
        ],
    }


def _things(request: Request, scene: Snapshot) -> list[dict[str, Any]]:
    words = set(request.text.casefold().split())

    def rank(thing: Thing) -> tuple[bool, float]:
        is_named = not words.isdisjoint((thing.kind, thing.colour, thing.thing_id))
        return (not is_named, _distance_m(thing, scene.robot))

    nearest = sorted(scene.things, key=rank)[:MOST_THINGS]
    return [dict(_thing(one, scene.robot)) for one in nearest]


def _thing(thing: Thing, robot: Viewpoint | None) -> Iterator[tuple[str, Any]]:
    yield "id", plain(thing.thing_id)
    yield "kind", plain(thing.kind) if thing.kind != _UNKNOWN_KIND else "not recognised"
    yield "colour", plain(thing.colour)
    yield "size", size_word(thing)
    if thing.rests is not None:
        yield plain(thing.rests.relation), plain(thing.rests.of)
    if thing.held_by:
        yield "held_by", plain(thing.held_by)
    if robot is not None:
        yield "away_m", round(_distance_m(thing, robot), 1)


def _distance_m(thing: Thing, robot: Viewpoint | None) -> float:
    return 0.0 if robot is None else math.dist(thing.xy_m, (robot.x_m, robot.y_m))


def _held(what: str | None) -> str | None:
    return None if what is None else plain(what)


def _turn(turn: Turn) -> dict[str, str]:
    row = {
        "person": plain(turn.said, SENTENCE_CHARACTERS),
        "done": plain(turn.understood, SENTENCE_CHARACTERS),
        "robot": plain(turn.answer, SENTENCE_CHARACTERS),
        "ended": turn.outcome.value,
    }
    return {key: value for key, value in row.items() if value}


def fitted(situation: Mapping[str, Any], room: int) -> dict[str, Any]:
    """Return a situation of at most `room` characters of data, its least important rows left out.

    Rows that were left out are counted under `left_out`. What is in no row of the order stays.
    """
    kept = {**situation, "left_out": situation.get("left_out", 0)}
    rows_of = [value for value in kept.values() if isinstance(value, list)]
    length = len(as_data(kept)) + len(str(sum(map(len, rows_of))))
    for name, least in CUT_ORDER:
        rows = list(kept.get(name, ()))
        while length > room and len(rows) > least:
            length -= len(as_data(rows.pop())) + _COMMA
            kept["left_out"] += 1
        if name in kept:
            kept[name] = rows
    return kept


def plain(text: object, most: int = NAME_CHARACTERS) -> str:
    """Return a text on one line, without control and invisible characters, and bounded."""
    visible = "".join(
        one
        for one in str(text)[: _LOOKED_AT * most]
        if one.isspace() or not unicodedata.category(one).startswith("C")
    )
    return " ".join(visible.split())[:most]


def as_data(document: Any) -> str:
    """Return JSON of ASCII alone, in which nothing looks like a tag."""
    return json.dumps(document, separators=(",", ":")).translate(_ESCAPES)
