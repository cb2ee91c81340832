"""Compose one question to a model: instructions from template files, everything else as data."""

import json
import math
import unicodedata
from collections.abc import Iterator, Mapping
from functools import cache
from pathlib import Path
from string import Template
from typing import Any, Final

from vla_deploy.client.battery import battery_words
from vla_deploy.client.command_record import MOST_CHARACTERS
from vla_deploy.model_servers.chat import Chat, ChatMessage
from vla_deploy.planning.interfaces import ActionNote, PlanRequest
from vla_deploy.planning.understanding import ConversationTurn
from vla_deploy.plans.catalogue import SKILLS
from vla_deploy.plans.knowledge import World
from vla_deploy.world import Snapshot, Thing, Viewpoint
from vla_deploy.world.vocabulary import OBJECT_CLASSES, size_word

TEMPLATES: Final = Path(__file__).parent
ROOM: Final = 14_000
"""Characters of a prompt, schema included: about a quarter as many tokens."""
# Enough for what failed and all that was done before it.
_FAILURE_CHARACTERS: Final = 600


def chat_for(request: PlanRequest, robot: str, room: int = ROOM, jpeg: bytes | None = None) -> Chat:
    """Return the question; of the situation so much is told that `room` characters suffice."""
    extra = [*(("scene_analysis",) if jpeg else ()), *(("recovery",) if request.failed else ())]
    fields = {
        "robot": plain(robot),
        "skills": skills_in_words(request.world.skills),
        "limits": "\n".join(f"- {one}" for one in limits(request.world)),
    }
    system = "\n\n".join(filled(part, **fields) for part in ("plan", "safety", *extra))
    command = as_data(plain(request.text, MOST_CHARACTERS))
    text = "<situation>\n{}\n</situation>\n<command>{}</command>"
    data_room = room - len(system) - len(text) - len(command)
    data = as_data(fitted(situation_of(request), data_room))
    images = () if jpeg is None else (jpeg,)
    message = ChatMessage(text=text.format(data, command), images=images)
    return Chat(system=system, messages=(message,), schema_name="plan")


def filled(name: str, **fields: str) -> str:
    """Return the text of a template file with its fields filled."""
    return _template(name).substitute(fields).strip()


@cache
def _template(name: str) -> Template:
    return Template((TEMPLATES / f"{name}.md").read_text(encoding="utf-8"))


@cache
def skills_in_words(skills: frozenset[str]) -> str:
    """Return skills, each on a line: its name, its parameters, what it does."""
    return "\n".join(
        f"- {name}({', '.join(spec.parameters)}): {spec.summary}"
        for name, spec in SKILLS.items()
        if name in skills
    )


def limits(world: World) -> Iterator[str]:
    """Yield what bounds a plan for this robot: how it moves, what it reaches and carries."""
    speed = "" if world.max_speed_m_s is None else f", at most {world.max_speed_m_s:g} m/s"
    if "move" in world.skills:
        way = f"on wheels, on one level floor{speed}"
        yield f"it drives {way}; no stairs, steps, thresholds or ramps"
    else:
        yield "it stays where it stands, and cannot drive"
    if world.footprint_radius_m:
        yield f"it needs a way {2 * world.footprint_radius_m:.2f} m wide, and opens no doors"
    yield f"it recognises these kinds of things: {', '.join(OBJECT_CLASSES)}"
    yield f"at most {world.bounds.max_actions} steps"
    if math.isfinite(world.bounds.payload_kg):
        yield f"a hand carries at most {world.bounds.payload_kg:g} kg"
    if world.opening_max_m is not None:
        yield f"a hand opens {world.opening_max_m:.2f} m wide; what is wider cannot be taken"
    if world.reach is not None:
        low_m, high_m = world.reach.grip_heights_m
        yield (
            f"its hands reach {max(world.reach.distances_m):g} m in front of its middle, {low_m:g} "
            f"to {high_m:g} m above the {'floor' if 'move' in world.skills else 'table'}"
        )
    if world.poses:
        yield f"poses of the arms: {', '.join(sorted(map(plain, world.poses)))}"
    if world.devices:
        names = sorted({plain(one) for one in world.devices.values()})
        yield f"devices of the home that it can switch: {', '.join(names)}"
    for zone in world.zones:
        yield f"it must not enter {plain(zone.name)}: {plain(zone.reason, 120)}"
    yield "it handles no people, animals, fire, blades, medicine or hot liquids"


# --- the situation as data: no text in it can end the data ----------------------------------------

NAME_CHARACTERS: Final = 60
SENTENCE_CHARACTERS: Final = 200
_LOOKED_AT: Final = 4  # times as much as may be left when white space is folded
# What could end the data is written as an escape of JSON.
_ESCAPES: Final = {ord("<"): "\\u003c", ord(">"): "\\u003e", ord("&"): "\\u0026"}
# What is cut first. The first rows of each matter most: things that the command names, then the
# nearest; what was said last.
CUT_ORDER: Final = (
    "remembered", "gone", "said_before", "last_actions", "failed_before", "things", "forbidden",
)  # fmt: skip
MOST_THINGS: Final = 30
MOST_RECOLLECTIONS: Final = 10
MOST_FORBIDDEN: Final = 20
# Farther than that from all of them, the robot is at no known place.
AT_PLACE_M: Final = 1.0
NOT_MEASURED: Final = "not measured"
_ON_OFF: Final = {True: "on", False: "off", None: "unknown"}
_UNKNOWN_KIND: Final = "object"


def situation_of(request: PlanRequest) -> dict[str, Any]:
    """Return all that a planner should know of a request, apart from the command itself."""
    scene = request.scene
    in_sight = frozenset() if scene is None else frozenset(one.kind for one in scene.things)
    remembered = request.experience.sentences(request.text, in_sight)
    return {
        "robot": _robot(request),
        "last_actions": [_action(one) for one in request.last_actions],
        "forbidden": [plain(one) for one in request.prohibitions[:MOST_FORBIDDEN]],
        "things": [] if scene is None else _things(request, scene),
        "gone": [] if scene is None else [plain(one.thing) for one in scene.lost],
        "hands": {
            plain(hand): what and plain(what) for hand, what in request.world.holding.items()
        },
        "devices": {
            plain(name): _ON_OFF[request.world.devices_on.get(name)]
            for name in sorted(set(request.world.devices.values()))
        },
        "places": sorted({plain(place) for place in request.world.places.values()}),
        "said_before": [_turn(one) for one in reversed(request.conversation.turns)],
        "remembered": [plain(one, SENTENCE_CHARACTERS) for one in remembered[:MOST_RECOLLECTIONS]],
        "failed_before": [plain(one, _FAILURE_CHARACTERS) for one in request.failed],
    }


def _robot(request: PlanRequest) -> dict[str, Any]:
    """Return where the robot is, in the map's frame, what it does, and how full its battery is."""
    here, battery = request.here, request.battery
    pose = None
    if here is not None:
        x_m, y_m, yaw_rad = (round(one, 2) for one in here)
        pose = {"x_m": x_m, "y_m": y_m, "yaw_rad": yaw_rad}
    return {
        "pose": pose,
        "at": plain(place_at(request)) or None,
        "battery": NOT_MEASURED if battery is None else plain(battery_words(battery)),
        "task": plain(request.task, SENTENCE_CHARACTERS) or None,
    }


def place_at(request: PlanRequest) -> str:
    """Return the known place that the robot is at, "" where it is at none or lost."""
    here, sites = request.here, request.world.sites.values()
    if here is None:
        return ""
    away_m = {one.name: math.dist((one.pose.x_m, one.pose.y_m), here[:2]) for one in sites}
    nearest = min(away_m, key=away_m.__getitem__, default="")
    return nearest if nearest and away_m[nearest] <= AT_PLACE_M else ""


def _action(note: ActionNote) -> dict[str, str]:
    given = ", ".join(f"{name} {value}" for name, value in note.parameters.items())
    row = {
        "skill": plain(note.skill),
        "with": plain(given, SENTENCE_CHARACTERS),
        "ended": plain(note.status),
        "error": plain(note.error, SENTENCE_CHARACTERS),
    }
    return {key: value for key, value in row.items() if value}


def _things(request: PlanRequest, scene: Snapshot) -> list[dict[str, Any]]:
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


def _turn(turn: ConversationTurn) -> dict[str, str]:
    row = {
        "person": plain(turn.said, SENTENCE_CHARACTERS),
        "done": plain(turn.understood, SENTENCE_CHARACTERS),
        "robot": plain(turn.answer, SENTENCE_CHARACTERS),
        "ended": turn.outcome.value,
    }
    return {key: value for key, value in row.items() if value}


def fitted(situation: Mapping[str, Any], room: int) -> dict[str, Any]:
    """Return a situation of at most `room` characters of data, its least important rows left out.

    What is in no row of the order stays.
    """
    kept = dict(situation)
    for name in CUT_ORDER:
        while kept[name] and len(as_data(kept)) > room:
            kept[name] = kept[name][:-1]
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
