"""Clean with what there is: put things away; look around places."""

from collections.abc import Mapping
from typing import Final

from vla_deploy.planning.interfaces import PlanRequest
from vla_deploy.planning.understanding.fitting import CommandContext, ThingUse, fitting
from vla_deploy.plans.catalogue import GRASPABLE_CLASSES
from vla_deploy.plans.errors import UnknownPlace
from vla_deploy.plans.knowledge import match_place, words_of
from vla_deploy.plans.plan import Skill
from vla_deploy.plans.table_setting import is_too_wide
from vla_deploy.world import Thing

STORE: Final = "box"
"""What "put it away" means where nothing else is said."""
MOST_THINGS: Final = 6
EVERYWHERE: Final = frozenset({"", "up", "mess", "room", "place", "house", "flat", "home",
                               "everything", "things", "apartment", "here"})  # fmt: skip


def tidy(fields: Mapping[str, str], request: PlanRequest) -> list[Skill]:
    """Put away what lies on a piece of furniture, or everywhere; look first where none is known.

    What fits the words of "except" stays, and so does what no hand can take, which is said.
    """
    lying = _lying(fields.get("where", ""), request)
    if "except" in fields:
        context = CommandContext(request)
        stays = fitting(context.read(fields["except"]), ThingUse.SEE, context)
        lying = [one for one in lying if one not in stays]
    if not lying:
        said = "I know of nothing there to put away. I look around."
        return [("speak", {"text": said}), *look_around(fields.get("where"))]
    wide = [one for one in lying if is_too_wide(one, request.world)]
    narrow = [one for one in lying if one not in wide]
    where = {"destination": STORE, "relation": "in"}
    steps: list[Skill] = [
        ("place", {"object": one.thing_id, **where}) for one in narrow[:MOST_THINGS]
    ]
    left = len(narrow) - MOST_THINGS
    kinds = ", ".join(one.kind for one in wide)
    told = (
        "That is put away." if narrow and left <= 0 else "",
        f"{left} more things are left; tell me again." if left > 0 else "",
        f"What is too wide for my hands stays: {kinds}." if wide else "",
    )
    return [*steps, ("speak", {"text": " ".join(filter(None, told))})]


def _lying(place: str, request: PlanRequest) -> list[Thing]:
    """Return what may be put away: not what is in a box already, nor of a kind that stays.

    Raises:
        UnknownPlace: the place is none that the robot knows.
    """
    surfaces: frozenset[str] = frozenset()
    if " ".join(words_of(place)) not in EVERYWHERE:
        name = match_place(place, request.world.places)
        if name is None:
            raise UnknownPlace(place, set(request.world.places.values()))
        surfaces = request.world.surfaces_of(name)
    return [
        one
        for one in (() if request.scene is None else request.scene.things)
        if one.kind in GRASPABLE_CLASSES
        and not one.held_by
        and (one.rests is None or one.rests.relation != "in")
        and (not surfaces or (one.rests is not None and one.rests.of in surfaces))
    ]


def look_around(place: str | None = None) -> list[Skill]:
    """Look to all sides, at a place if one is said."""
    there: list[Skill] = [] if place is None else [("navigate_to", {"place": place})]
    return there + [("look_at", {"direction": side}) for side in ("left", "ahead", "right", "down")]
