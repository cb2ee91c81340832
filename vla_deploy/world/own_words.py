"""Put what the robot knows in place of the words that a home has of its own."""

import re
from collections.abc import Iterator, Sequence
from typing import Final

from vla_deploy.robots import RobotDescription
from vla_deploy.robots.known_things import OwnWord
from vla_deploy.runtime.table_schema import TableFault
from vla_deploy.world.errors import UnknownWord
from vla_deploy.world.query import parse_query

_EXPECTED: Final = 'a thing by kind, colour and size, such as "big green bottle"'


class OwnWords:
    """Read "bring me the thermos" as "bring me the green bottle", where the robot file says so."""

    def __init__(self, words: Sequence[OwnWord]) -> None:
        self._meant = {_plain(one.said): one.means for one in words}
        longest_first = sorted(self._meant, key=len, reverse=True)
        said = "|".join(re.escape(one).replace(r"\ ", r"\s+") for one in longest_first)
        self._said = re.compile(rf"(?<![\w'])(?:{said})(?![\w'])", re.IGNORECASE)

    def read(self, text: str) -> str:
        """Return a text in words that the robot knows."""
        if not self._meant:
            return text
        return self._said.sub(lambda found: self._meant[_plain(found[0])], text.replace("’", "'"))


def word_faults(robot: RobotDescription) -> Iterator[TableFault]:
    """Yield which words of a robot file mean nothing that it knows, or mean something already."""
    taken = {*robot.places, *robot.devices}
    taken.update(*(one.aliases for one in robot.places.values()))
    taken.update(*(one.aliases for one in robot.devices.values()))
    seen: set[str] = set()
    for i, row in enumerate(robot.words):
        said = _plain(row.said)
        if said in seen or said.replace(" ", "_") in taken or said in taken or _is_known(said):
            expected = "words that mean nothing yet: no place, device, kind or colour, and once"
            yield TableFault(key=f"words[{i}].said", got=repr(row.said), expected=expected)
        if not _is_known(row.means):
            yield TableFault(key=f"words[{i}].means", got=repr(row.means), expected=_EXPECTED)
        seen.add(said)


def _plain(text: str) -> str:
    return " ".join(text.lower().split())


def _is_known(text: str) -> bool:
    try:
        parse_query(text)
    except UnknownWord:
        return False
    return True
