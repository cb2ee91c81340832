"""Read whether a device is on in what it has sent, which may be anything."""

import json
import re
import unicodedata
from dataclasses import dataclass
from typing import Any, Final

from vla_deploy.devices.errors import StateUnreadable

MOST_BYTES: Final = 65_536
"""No device that is switched has more to say."""
_MOST_SHOWN: Final = 60
_INDEX: Final = re.compile("[0-9]{1,6}")


def shown(said: object, most: int = _MOST_SHOWN) -> str:
    """Return what others say on one line, without control characters, and bounded."""
    text = said.decode(errors="replace") if isinstance(said, bytes) else str(said)
    visible = "".join(
        one
        for one in text[: 4 * most]
        if one.isspace() or not unicodedata.category(one).startswith("C")
    )
    line = " ".join(visible.split())
    return line if len(line) <= most else f"{line[:most]}..."


def document_in(payload: bytes) -> Any:
    """Return JSON of a bounded size.

    Raises:
        StateUnreadable: it is too long, or is none.
    """
    if len(payload) > MOST_BYTES:
        raise StateUnreadable(f"{len(payload)} bytes came, expected {MOST_BYTES} at most")
    try:
        return json.loads(payload)
    except (ValueError, RecursionError) as error:
        raise StateUnreadable(f'expected JSON, got "{shown(payload)}"') from error


@dataclass(frozen=True, slots=True, kw_only=True)
class StateWords:
    """Say how a device words its state; `pointer` leads to it in JSON (RFC 6901), "" is all."""

    on: str = "ON"
    off: str = "OFF"
    pointer: str = ""

    def is_on(self, payload: bytes) -> bool:
        """Return whether a payload says "on"; capitals and spaces around do not matter.

        Raises:
            StateUnreadable: it says neither "on" nor "off".
        """
        if len(payload) > MOST_BYTES:
            raise StateUnreadable(f"{len(payload)} bytes came, expected {MOST_BYTES} at most")
        value = _pointed(document_in(payload), self.pointer) if self.pointer else payload
        said = _plain(value)
        for word, is_on in ((self.on, True), (self.off, False)):
            if said == _plain(word):
                return is_on
        where = f" at {self.pointer}" if self.pointer else ""
        raise StateUnreadable(f'expected "{self.on}" or "{self.off}"{where}, got "{shown(value)}"')


def _plain(value: object) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    text = value.decode(errors="replace") if isinstance(value, bytes) else str(value)
    return text.strip().casefold()


def _pointed(document: Any, pointer: str) -> Any:
    for part in pointer.split("/")[1:]:
        key = part.replace("~1", "/").replace("~0", "~")
        if isinstance(document, dict) and key in document:
            document = document[key]
        elif isinstance(document, list) and _INDEX.fullmatch(key) and int(key) < len(document):
            document = document[int(key)]
        else:
            raise StateUnreadable(f'expected a value at {pointer}, there is no "{shown(key)}"')
    return document
