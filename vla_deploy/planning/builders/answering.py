"""Answer questions from what the robot knows now: what it sees, what it holds, where things are."""

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Final

from vla_deploy.client.battery import SILENT, battery_sentences
from vla_deploy.memory.episode import at_words, place_words
from vla_deploy.planning.dialogue.phrasing import listed
from vla_deploy.planning.interfaces import PlanRequest
from vla_deploy.planning.patterns.phrase import parts_of
from vla_deploy.planning.understanding.fitting import CommandContext, ThingUse, fitting
from vla_deploy.plans.knowledge import match_devices, match_place
from vla_deploy.plans.plan import Skill
from vla_deploy.plans.symbolic.state import Point
from vla_deploy.world import Snapshot, Thing
from vla_deploy.world.memory import place_of, seen_words
from vla_deploy.world.thing import FLOOR

Fields = Mapping[str, str]
MOST_TOLD = 6
READY = "I am ready for a command."
ABILITIES: Final = (
    ("navigate_to", "go to places"),
    ("find_object", "look for things and tell you what I see"),
    ("pick_up", "pick things up and put them in a box or on a table"),
    ("hand_over", "give them to you"),
    ("place", "tidy up"),
    ("move_arm", "bring my arm to a pose"),
    ("open_gripper", "open and close my hand"),
    ("turn_on", "switch lamps and sockets"),
    ("stop", "stand still when you tell me to"),
)
"""What each skill is good for, where the robot has it."""


def _tell_sight(fields: Fields, request: PlanRequest) -> list[Skill]:
    """Say what is known, on a piece of furniture if one is named."""
    things = [] if request.scene is None else list(request.scene.things)
    where = ""
    place = match_place(fields.get("where", ""), request.world.places)
    if place is not None:
        things = [one for one in things if one.rests is not None and one.rests.of == place]
        where = f" on the {place.replace('_', ' ')}"
    if not things:
        return _say(f"I see nothing{where}.")
    return _say(f"I see {_things(things)}{where}.")


def _tell_hands(_: Fields, request: PlanRequest) -> list[Skill]:
    """Say what the hands hold."""
    held = {one.held_by: str(one) for one in (request.scene.things if request.scene else ())}
    full = [
        f"{_a(held.get(hand, kind))} in my {_hand_words(hand)}"
        for hand, kind in request.world.holding.items()
        if kind
    ]
    return _say(f"I hold {listed(full)}." if full else "My hands are empty.")


def _hand_words(hand: str) -> str:
    name = hand.split("_")[0]
    return name if name == "hand" else f"{name} hand"


def _tell_place(_: Fields, request: PlanRequest) -> list[Skill]:
    """Say near which place the robot is."""
    here = request.here
    if here is None or not request.world.sites:
        return _say("I do not know where I am.")
    sites = request.world.sites.values()
    nearest = min(sites, key=lambda one: math.dist((one.pose.x_m, one.pose.y_m), here[:2]))
    return _say(f"I am near the {nearest.name.replace('_', ' ')}.")


def tell_or_find(fields: Fields, request: PlanRequest) -> list[Skill]:
    """Say where a thing is if that is known, else where it was, and look for it."""
    found = _known(fields["what"], request)
    if not found or request.scene is None:
        look: Skill = ("find_object", {"object": fields["what"]})
        return [*_remembered(fields["what"], request), look]
    sites = request.world.sites.values()
    places = {one.name: (one.pose.x_m, one.pose.y_m) for one in sites}
    return _say(" ".join(_where(one, places, request.scene) for one in found[:MOST_TOLD]))


def _tell_whether(fields: Fields, request: PlanRequest) -> list[Skill]:
    """Say whether a thing is in sight."""
    found = _known(fields["what"], request)
    return _say(f"Yes, I see {_things(found)}." if found else "No, I do not see that.")


def _tell_devices(fields: Fields, request: PlanRequest) -> list[Skill]:
    """Say whether devices of the home are on, as they have told."""
    world = request.world
    parts = parts_of(fields["device"])
    names = dict.fromkeys(name for one in parts for name in match_devices(one, world))
    return _say(" ".join(_device(name, world.devices_on.get(name)) for name in names))


def _device(name: str, is_on: bool | None) -> str:
    called = name.replace("_", " ")
    if is_on is None:
        return f"I do not know whether the {called} is on: it does not answer."
    return f"The {called} is {'on' if is_on else 'off'}."


def _things(things: Sequence[Thing]) -> str:
    """Return things as one says them: "a red cup, a blue ball and 3 more"."""
    words = [_a(str(one)) for one in things[:MOST_TOLD]]
    more = len(things) - len(words)
    return listed([*words, f"{more} more"] if more > 0 else words)


def _known(text: str, request: PlanRequest) -> list[Thing]:
    if request.scene is None:
        return []
    context = CommandContext(request)
    return fitting(context.read(text), ThingUse.SEE, context)


def _remembered(text: str, request: PlanRequest) -> list[Skill]:
    """Say where such a thing was in earlier runs, if that is remembered."""
    query = CommandContext(request).read(text).query
    seen = request.experience.where(query.kind, query.colour)
    if seen is None:
        return []
    return _say(place_words(seen, request.experience.now_s) + " I will look for it.")


def _where(thing: Thing, places: Mapping[str, Point], scene: Snapshot) -> str:
    rests = None if thing.held_by or thing.rests is None or thing.rests.of == FLOOR else thing.rests
    where = at_words(place_of(thing, places)) if rests is None else rests.words
    return f"The {thing} is {where}, {seen_words(scene.unseen_s(thing))}."


def _a(words: str) -> str:
    if words.split()[-1:] == ["keys"]:
        return words
    return f"{'an' if words[:1] in 'aeiou' else 'a'} {words}"


def _say(text: str) -> list[Skill]:
    return [("speak", {"text": text[:500]})]


def _tell_battery(_: Fields, request: PlanRequest) -> list[Skill]:
    """Say how full the battery is, or why that is not known."""
    if request.battery is None:
        return _say(f"I cannot measure how full my battery is: {SILENT}.")
    return _say(battery_sentences(request.battery))


def _tell_doing(_: Fields, request: PlanRequest) -> list[Skill]:
    turns = request.conversation.turns
    return _say(f"The last that I was told is: {turns[-1].said}." if turns else READY)


ANSWERS: Final[Mapping[str, Callable[[Fields, PlanRequest], list[Skill]]]] = {
    "holding": _tell_hands,
    "seeing": _tell_sight,
    "place": _tell_place,
    "whether": _tell_whether,
    "device": _tell_devices,
    "doing": _tell_doing,
    "able": lambda _, request: _say(
        f"I can {listed([text for skill, text in ABILITIES if skill in request.world.skills])}."
    ),
    # One that may not move refuses every plan before.
    "ready": lambda _fields, _request: _say(READY),
    "thanks": lambda _fields, _request: _say("You are welcome."),
    "battery": _tell_battery,
}
"""What each subject of a question is answered by."""
