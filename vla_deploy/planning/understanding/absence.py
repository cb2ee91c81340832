"""Say that what is described is not among what is there: "there are only two books"."""

from collections.abc import Mapping, Sequence
from typing import Final

from vla_deploy.planning.errors import NotThere
from vla_deploy.planning.understanding.expression import Expression
from vla_deploy.world import Thing
from vla_deploy.world.vocabulary import ANY_CLASS

_COUNTED: Final = ("no", "one", "two", "three", "four", "five")
_PLURALS: Final[Mapping[str, str]] = {"box": "boxes", "keys": "keys"}


def not_there(read: Expression, things: Sequence[Thing]) -> NotThere:
    """Return why nothing fits; `things` are those that would, if they were not compared."""
    noun = _noun(read, len(things))
    if not things:
        return NotThere(f'I see no {noun}, so I cannot tell which is "{read.said}"')
    if read.place is not None and len(things) < read.place.number:
        are = "is" if len(things) == 1 else "are"
        return NotThere(f"there {are} only {_number(len(things))} {noun}")
    if read.besides:
        known = " and ".join(dict.fromkeys(f"the {one}" for one in things))
        return NotThere(f"I see no {_noun(read, 1)} but {known}")
    if read.near is not None:
        return NotThere(f'I do not see "{read.near.said}", so I cannot tell what is near it')
    return NotThere(f'I see nothing that is "{read.said}"')


def not_as_many(read: Expression, things: Sequence[Thing]) -> NotThere:
    """Return why other things are there than were counted."""
    there = f"{_number(len(things))} {_noun(read, len(things))}"
    if len(things) < read.count:
        return NotThere(f"I see only {there}")
    return NotThere(f"I see {there}, and cannot tell which {_number(read.count)} you mean")


def _noun(read: Expression, count: int) -> str:
    """Return what the things are called, in the singular for one or none."""
    kind = "thing" if read.query.kind == ANY_CLASS else read.query.kind
    spoken = kind if count < 2 else _PLURALS.get(kind, f"{kind}s")
    return " ".join(word for word in (read.query.colour, spoken) if word)


def _number(count: int) -> str:
    return _COUNTED[count] if count < len(_COUNTED) else str(count)
