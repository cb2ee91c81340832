"""Resolve places: spoken names, parts of them ("the table"), slips of them, and "there"."""

import math
import re
from collections.abc import Mapping
from typing import Final

from vla_deploy.planning.errors import UnknownPlace
from vla_deploy.planning.references import match_place, words_of
from vla_deploy.planning.understanding import phrases
from vla_deploy.planning.understanding.conversation import Mention, Role
from vla_deploy.planning.understanding.insertions import surface_of
from vla_deploy.planning.understanding.names import Match, closest
from vla_deploy.planning.understanding.questions import did_you_mean, where, which_place
from vla_deploy.planning.understanding.referents import MISSPELT
from vla_deploy.planning.understanding.resolver import Resolver

# That near to where one stands for a place, one is there.
AT_PLACE_M: Final = 0.8
MOST_LETTERS: Final = 60


def resolve_place(text: str, resolver: Resolver) -> str:
    """Return the place that a text means, and log why.

    Raises:
        UnknownPlace: no place is called so, or nearly so.
        Ambiguous: several are.
    """
    known = resolver.setting.request.world.places
    key = _key(text)
    answer = resolver.setting.request.conversation.choices.get(key)
    if answer is not None and match_place(answer, known):
        return _noted(resolver, text, str(match_place(answer, known)), "you said so")
    exact = match_place(key, known)
    if exact is not None:
        return _noted(resolver, text, exact, "its name")
    if phrases.PRONOUNS.get(key) == phrases.THERE or phrases.PRONOUNS.get(key) == phrases.IT:
        return _there(text, resolver)
    return _by_part(text, key, resolver)


def is_like_place(text: str, places: Mapping[str, str]) -> bool:
    """Tell whether a text is the name of a place, a part of one, or like one."""
    key = _key(text)
    spoken = phrases.PRONOUNS.get(key) in (phrases.THERE, phrases.HERE)
    return bool(key) and (spoken or bool(_named(key, places)) or closest(key, places) is not None)


def _key(text: str) -> str:
    words = words_of(text.replace("_", " ")[:MOST_LETTERS])
    # "The table here" is a table.
    while len(words) > 1 and words[-1] in ("here", "there", "over"):
        words = words[:-1]
    return " ".join(words)


def _named(key: str, places: Mapping[str, str]) -> tuple[str, ...]:
    """Return the places that a text names by whole words of a name."""
    part = re.compile(rf"(?:.* )?{re.escape(key)}(?: .*)?")
    return tuple(dict.fromkeys(one for name, one in places.items() if part.fullmatch(name)))


def _there(text: str, resolver: Resolver) -> str:
    for one in resolver.setting.spoken_of():
        if one.role is Role.PLACE:
            return _noted(resolver, text, one.means, "spoken of last")
    raise where(tuple(sorted(set(resolver.setting.request.world.places.values()))), _key(text))


def _by_part(text: str, key: str, resolver: Resolver) -> str:
    """Take whole words of a name for it where they leave one, else the nearest spelling."""
    places = resolver.setting.request.world.places
    named = _named(key, places) if key else ()
    if len(named) == 1:
        return _noted(resolver, text, named[0], "part of its name")
    if named:
        return _one_of(text, key, named, resolver)
    match = closest(key, places) if key else None
    if match is None:
        raise UnknownPlace(text[:MOST_LETTERS], set(places.values()))
    meant = tuple(dict.fromkeys(places[name] for name in match.known))
    if len(meant) == 1 and Match(word=key, known=meant, likeness=match.likeness).is_sure:
        return _noted(resolver, text, meant[0], f"{match.likeness.value}", MISSPELT)
    raise did_you_mean(match, key)


def _one_of(text: str, key: str, named: tuple[str, ...], resolver: Resolver) -> str:
    """Choose among places with a common name: in the room named before, here, or spoken of."""
    request, view = resolver.setting.request, resolver.setting.view
    for one in reversed(resolver.setting.mentions):
        if surface_of(one.means, request.world) in named:
            table = surface_of(one.means, request.world)
            return _noted(resolver, text, table, f"at the {one.means}")
    for name in named:
        site = request.world.sites.get(name)
        if site is None or view is None:
            continue
        if math.dist((site.pose.x_m, site.pose.y_m), (view.x_m, view.y_m)) <= AT_PLACE_M:
            return _noted(resolver, text, name, "I am there")
    for one in resolver.setting.spoken_of():
        if one.role is Role.PLACE and one.means in named:
            return _noted(resolver, text, one.means, "we spoke of it just now")
    raise which_place(named, key)


def _noted(resolver: Resolver, text: str, place: str, why: str, certainty: float = 1.0) -> str:
    said = text.strip()
    resolver.referents.note(said, Role.PLACE, place, why, certainty=certainty)
    resolver.setting.mentions.append(Mention(said=said, means=place, role=Role.PLACE))
    return place
