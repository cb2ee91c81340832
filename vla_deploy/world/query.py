"""Ask for things in words: "the nearest small cup", "red ball on the coffee table".

    query    = [order] {size} [colour] kind [relation query]  |  id  |  surface
    order    = nearest | closest | farthest
    size     = small | little | big | large | tall | flat | long
    relation = in | on | under | next to | near | left of | right of | in front of | behind

A surface is the name of furniture, and stands behind a relation only.
"""

import math
import re
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Final

from vla_deploy.world.errors import UnknownWord
from vla_deploy.world.relations import NEXT_TO, RELATIONS, is_near, is_under
from vla_deploy.world.resting import IN, ON
from vla_deploy.world.thing import Rest, Snapshot, Thing, Viewpoint
from vla_deploy.world.vocabulary import (
    ANY_CLASS,
    ARTICLES,
    COLOURS,
    COMPARED,
    FILLERS,
    FORMS,
    OBJECT_CLASSES,
    SYNONYMS,
    compared,
    form_words,
)

NEAR: Final = "near"
# What people say, the longest first, and the relation that it means.
PHRASES: Final[Mapping[str, str]] = MappingProxyType(
    {
        "to left of": "left of", "to right of": "right of", "in front of": "in front of",
        "on top of": ON, "left of": "left of", "right of": "right of", "next to": NEXT_TO,
        "close to": NEAR, "inside of": IN,
        "beside": NEXT_TO, "behind": "behind", "inside": IN, "under": "under", "below": "under",
        "near": NEAR, "in": IN, "on": ON,
    }
)  # fmt: skip
ORDERS: Final[Mapping[str, int]] = MappingProxyType({"nearest": 1, "closest": 1, "farthest": -1})
# These change with who looks, and so while the robot drives.
FROM_A_VIEW: Final = frozenset({"left of", "right of", "in front of", "behind"})
_ID: Final = re.compile(r"[a-z]+_\d+")


@dataclass(frozen=True, slots=True, kw_only=True)
class Query:
    """Say which things are meant; what is empty means any.

    `anchor` is what they stand in `relation` to; `surface` alone names furniture. `is_named` tells
    whether a kind or an id was said, rather than any kind meant.
    """

    kind: str = ANY_CLASS
    colour: str = ""
    thing_id: str = ""
    surface: str = ""
    sizes: tuple[str, ...] = ()
    order: str = ""
    relation: str = ""
    anchor: "Query | None" = None
    is_named: bool = field(default=False, compare=False)

    def fits(self, thing: Thing) -> bool:
        """Return whether a thing by itself is one of those meant, whatever is around it."""
        if self.thing_id:
            return thing.is_called(self.thing_id)
        right_kind = self.kind in (ANY_CLASS, thing.kind)
        right_form = all(word in form_words(thing) for word in self.sizes if word in FORMS)
        return right_kind and right_form and self.colour in ("", thing.colour)

    def among(self, snapshot: Snapshot, view: Viewpoint | None = None) -> list[Thing]:
        """Return the things meant, as `find` does."""
        return find(self, snapshot, view)

    def __str__(self) -> str:
        own = self.thing_id or self.surface.replace("_", " ")
        words = [self.order, *self.sizes, self.colour, self.kind] if not own else [own]
        words += [self.relation, str(self.anchor)] if self.anchor else []
        return " ".join(word for word in words if word)


def find(query: Query, snapshot: Snapshot, view: Viewpoint | None = None) -> list[Thing]:
    """Return the things meant, the nearest to who looks first; `view` is the robot's by default."""
    view = view or snapshot.robot
    found = [thing for thing in snapshot.things if query.fits(thing)]
    if query.anchor is not None:
        found = [one for one in found if _stands(one, query.relation, query.anchor, snapshot, view)]
    for word in query.sizes:
        if word in COMPARED:
            found = compared(word, found)
    if view is not None:
        here = (view.x_m, view.y_m)
        found.sort(key=lambda thing: math.dist(thing.xy_m, here))
    if query.order and view is not None:
        return found[:1] if ORDERS[query.order] > 0 else found[-1:]
    return found


def _stands(
    thing: Thing, relation: str, anchor: Query, snapshot: Snapshot, view: Viewpoint | None
) -> bool:
    if anchor.surface:
        if relation in ("under", NEAR):
            named = [one for one in snapshot.surfaces if one.name == anchor.surface]
            return any(is_under(thing, one) for one in named)
        return thing.rests == Rest(relation, anchor.surface)
    test = is_near if relation == NEAR else RELATIONS[relation]
    return any(
        other is not thing and test(thing, other, view) for other in find(anchor, snapshot, view)
    )


def parse_query(text: str, furniture: Mapping[str, str] | None = None) -> Query:
    """Read a query; `furniture` maps the spoken names of furniture to the surfaces' names.

    Raises:
        UnknownWord: a word of it is none of the vocabulary, or there is a kind too many.
    """
    # Ids such as "cup_1" are one word; articles and fillers say nothing.
    words = [word for word in re.findall(r"[a-z0-9_]+", text.lower()) if word not in ARTICLES]
    own, relation, rest = _split(words)
    if not relation:
        return _description(own, text)
    if not rest:
        raise UnknownWord(text, relation, ("a thing or a piece of furniture behind it",))
    spoken = " ".join(rest)
    surface = (furniture or {}).get(spoken, "")
    anchor = Query(surface=surface) if surface else parse_query(spoken, furniture)
    if surface and relation not in (IN, ON, "under", NEAR):
        raise UnknownWord(text, relation, ("on", "under"))
    return _description(own, text, relation, anchor)


def _split(words: list[str]) -> tuple[list[str], str, list[str]]:
    """Return the words before the first relation, the relation, and the words behind it."""
    for start in range(len(words)):
        for phrase, relation in PHRASES.items():
            length = phrase.count(" ") + 1
            if " ".join(words[start : start + length]) == phrase:
                return words[:start], relation, words[start + length :]
    return words, "", []


def _description(
    words: list[str], text: str, relation: str = "", anchor: Query | None = None
) -> Query:
    known = [SYNONYMS.get(word, word) for word in words if word not in FILLERS]
    if len(known) == 1 and _ID.fullmatch(known[0]):
        return Query(thing_id=known[0], relation=relation, anchor=anchor, is_named=True)
    kinds = [word for word in known if word in OBJECT_CLASSES]
    for word in known:
        if not any(word in group for group in _GROUPS):
            raise UnknownWord(text, word, (*OBJECT_CLASSES, *COLOURS))
    colours = [word for word in known if word in COLOURS]
    if len(kinds) > 1 or len(colours) > 1:
        raise UnknownWord(
            text, (kinds if len(kinds) > 1 else colours)[1], ("one kind, one colour",)
        )
    return Query(
        kind=kinds[0] if kinds else ANY_CLASS,
        colour=colours[0] if colours else "",
        sizes=tuple(word for word in known if word in COMPARED or word in FORMS),
        order=next((word for word in known if word in ORDERS), ""),
        relation=relation,
        anchor=anchor,
        is_named=bool(kinds),
    )


_GROUPS: Final[tuple[Collection[str], ...]] = (OBJECT_CLASSES, COLOURS, COMPARED, FORMS, ORDERS)
