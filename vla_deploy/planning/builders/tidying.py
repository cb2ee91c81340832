"""Clean with what there is: put things away or back, and drive over the floor in rows."""

from collections.abc import Iterator, Mapping
from typing import Final

from vla_deploy.planning.catalogue import GRASPABLE_CLASSES
from vla_deploy.planning.errors import NotAble, UnknownPlace
from vla_deploy.planning.interfaces import Request
from vla_deploy.planning.knowledge import match_place, words_of
from vla_deploy.planning.plan import Skill
from vla_deploy.planning.understanding.conversation import Mention
from vla_deploy.planning.understanding.expressions import read_expression
from vla_deploy.planning.understanding.fitting import Setting, Use, fitting
from vla_deploy.world import Thing

STORE: Final = "box"
"""What "put it away" means where nothing else is said."""
MOST_THINGS: Final = 6
EVERYWHERE: Final = frozenset({"", "up", "mess", "room", "place", "house", "flat", "home",
                               "everything", "things", "apartment", "here"})  # fmt: skip
# Half the side of the square around a place, and how far apart the rows are.
REACH_M: Final = 1.0
ROW_M: Final = 0.5
MOST_POINTS: Final = 20


def tidy(fields: Mapping[str, str], request: Request) -> list[Skill]:
    """Put away what lies on a piece of furniture, or everywhere; look first where none is known.

    What fits the words of "except" stays.
    """
    stays = _fitting(fields["except"], request) if "except" in fields else []
    lying = [one for one in _lying(fields.get("where", ""), request) if one not in stays]
    if not lying:
        said = "I know of nothing there to put away. I look around."
        return [("speak", {"text": said}), *look_around(fields.get("where"))]
    steps: list[Skill] = []
    for thing in lying[:MOST_THINGS]:
        where = {"destination": STORE, "relation": "in"}
        steps.append(("place", {"object": thing.thing_id, **where}))
    left = len(lying) - MOST_THINGS
    said = f"{left} more things are left; tell me again." if left > 0 else "That is put away."
    return [*steps, ("speak", {"text": said})]


def _fitting(text: str, request: Request) -> list[Thing]:
    setting = Setting(request)
    return fitting(read_expression(text, setting.furniture), Use.SEE, setting)


def _lying(place: str, request: Request) -> list[Thing]:
    """Return what can be put away: not what is in a box already, nor what a hand cannot take.

    Raises:
        UnknownPlace: the place is none that the robot knows.
    """
    things = () if request.scene is None else request.scene.things
    surfaces = _surfaces(place, request)
    return [
        one
        for one in things
        if one.kind in GRASPABLE_CLASSES
        and not one.held_by
        and (one.rests is None or one.rests.relation != "in")
        and (not surfaces or (one.rests is not None and one.rests.of in surfaces))
    ]


def _surfaces(place: str, request: Request) -> frozenset[str]:
    """Return the furniture of a place, or nothing where everywhere is meant."""
    if " ".join(words_of(place)) in EVERYWHERE:
        return frozenset()
    name = match_place(place, request.world.places)
    if name is None:
        raise UnknownPlace(place, set(request.world.places.values()))
    return request.world.surfaces_of(name)


def look_around(place: str | None = None) -> list[Skill]:
    """Look to all sides, at a place if one is said."""
    there: list[Skill] = [] if place is None else [("navigate_to", {"place": place})]
    return there + [("look_at", {"direction": side}) for side in ("left", "ahead", "right", "down")]


def patrol(place: str, request: Request) -> list[Skill]:
    """Drive over the free floor around a place in rows.

    Raises:
        NotAble: no map is at hand, or no floor is free there.
    """
    name = match_place(place, request.world.places)
    site = request.world.sites.get(name or "")
    if site is None:
        raise NotAble(f'I do not know the area "{place}"')
    if request.world.is_free is None:
        raise NotAble("without a map I cannot drive over an area")
    points = list(_rows(request, site.pose.x_m, site.pose.y_m))
    if not points:
        raise NotAble(f"the map shows no free floor around the {name}")
    return [("navigate_to", {"x_m": x_m, "y_m": y_m}) for x_m, y_m in points[:MOST_POINTS]]


def _rows(request: Request, x_m: float, y_m: float) -> Iterator[tuple[float, float]]:
    """Yield the ends of rows of free floor in a square, each row begun where the last ended."""
    is_free = request.world.is_free
    count = round(2 * REACH_M / ROW_M) + 1
    steps = [round(-REACH_M + ROW_M * step, 3) for step in range(count)]
    for number, across_m in enumerate(steps):
        row_y_m = round(y_m + across_m, 3)
        row = [round(x_m + along_m, 3) for along_m in steps]
        free = [at for at in row if is_free is not None and is_free(at, row_y_m)]
        ends = sorted({free[0], free[-1]}) if free else []
        for at in ends if number % 2 == 0 else reversed(ends):
            yield at, row_y_m


# --- where a thing was before a hand took it: in this talk, else in what is remembered ------------


def put_back(said: str, request: Request) -> list[Skill]:
    """Put a thing where it was before a hand took it.

    Raises:
        NotAble: nobody remembers where that was, or it was on nothing that takes things.
    """
    meant = _meant(said, request)
    for place in () if meant is None else _places(meant, request):
        relation = "in" if _is_thing(place, request) else "on"
        return [("place", {"object": said, "destination": place, "relation": relation})]
    raise NotAble("I do not remember where it was; say where it shall go")


def _meant(said: str, request: Request) -> Mention | None:
    """Return the one thing that shall go back: what is held before what was spoken of."""
    setting = Setting(request)
    read = read_expression(said, setting.furniture)
    if read.pronoun:
        spoken = (one for one in setting.spoken_of() if one.kind and one.thing_id)
        return setting.held() or next(spoken, None)
    found = fitting(read, Use.PUT, setting)
    held = [one for one in found if one.held_by] or found
    return Mention.of(held[0]) if len(held) == 1 else None


def _places(meant: Mention, request: Request) -> Iterator[str]:
    """Yield where a thing was, the surest memory first, as far as things can be put there."""
    for one in request.conversation.mentions():
        is_same = one.thing_id == meant.thing_id if meant.thing_id else one.kind == meant.kind
        if is_same and one.rested and _takes_things(one.rested, request):
            yield one.rested
    for seen in request.last_seen:
        is_same = seen.kind == meant.kind and meant.colour in ("", seen.colour)
        if is_same and _takes_things(seen.place, request):
            yield str(match_place(seen.place, request.world.places))


def _takes_things(place: str, request: Request) -> bool:
    name = match_place(place, request.world.places)
    return name in request.world.furniture if name is not None else _is_thing(place, request)


def _is_thing(place: str, request: Request) -> bool:
    return request.scene is not None and request.scene.thing(place) is not None
