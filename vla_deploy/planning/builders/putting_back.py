"""Find where a thing was before a hand took it: in this talk, else in what is remembered."""

from collections.abc import Iterator

from vla_deploy.memory.episode import LastSeen
from vla_deploy.planning.errors import NotAble
from vla_deploy.planning.interfaces import Request
from vla_deploy.planning.plan import Skill
from vla_deploy.planning.references import match_place
from vla_deploy.planning.understanding.conversation import Mention
from vla_deploy.planning.understanding.expressions import read_expression
from vla_deploy.planning.understanding.fitting import Use, fitting
from vla_deploy.planning.understanding.setting import Setting


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
        if _is_same(seen, meant) and _takes_things(seen.place, request):
            yield str(match_place(seen.place, request.world.places))


def _is_same(seen: LastSeen, meant: Mention) -> bool:
    return seen.kind == meant.kind and meant.colour in ("", seen.colour)


def _takes_things(place: str, request: Request) -> bool:
    name = match_place(place, request.world.places)
    return name in request.world.furniture if name is not None else _is_thing(place, request)


def _is_thing(place: str, request: Request) -> bool:
    return request.scene is not None and request.scene.thing(place) is not None
