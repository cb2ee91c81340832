"""Read referring expressions: "the red cup" is a class and a colour, "the kitchen" a place."""

import re
from collections.abc import Mapping
from dataclasses import replace
from functools import lru_cache

from vla_deploy.planning.errors import DependsOnView, UnknownObject
from vla_deploy.world import Query, UnknownWord, parse_query
from vla_deploy.world.query import FROM_A_VIEW
from vla_deploy.world.vocabulary import ARTICLES, OBJECT_CLASSES


def words_of(text: str) -> list[str]:
    """Return lower-case words without articles and punctuation."""
    words = re.findall(r"[a-z0-9_]+", text.lower())
    return [word for word in words if word not in ARTICLES]


@lru_cache(maxsize=512)
def parse_object(text: str) -> Query:
    """Read "the red cup", "mug", "the small cup next to the book", or an id such as "cup_1".

    Its kind is known of an id, too; an empty colour means any.

    Raises:
        UnknownObject: no word of it, or one word too many, is a kind or colour the robot knows.
        DependsOnView: it says left, right, in front or behind.
    """
    try:
        asked = parse_query(text)
    except UnknownWord as error:
        raise UnknownObject(text.strip(), OBJECT_CLASSES) from error
    if asked.relation in FROM_A_VIEW:
        raise DependsOnView(text.strip(), OBJECT_CLASSES)
    kind = asked.thing_id.rpartition("_")[0] or asked.kind
    if kind not in OBJECT_CLASSES or not asked.is_named:
        raise UnknownObject(text.strip(), OBJECT_CLASSES)
    return replace(asked, kind=kind)


def match_place(text: str, places: Mapping[str, str]) -> str | None:
    """Return the place that `text` names, or None; `places` maps every spoken name to a place."""
    spoken = " ".join(words_of(text.replace("_", " ")))
    return places.get(spoken)
