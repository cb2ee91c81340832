"""Read what a command topic carries: words, or JSON with words, a plan or a mission in it."""

import json
import unicodedata
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

from vla_deploy.client.command_record import MOST_CHARACTERS

MOST_BYTES: Final = 32_000
"""Of one message: more than any plan that the planner takes has."""
WORDS_KEYS: Final = ("original_command", "command", "text", "goal", "data")
PLAN_KEYS: Final = ("actions", "action_sequence", "plan", "steps", "primitives")
STOP_WORDS: Final = frozenset({"stop", "halt", "freeze", "cancel"})
_BLANKS: Final = frozenset("\t\n\r")
_SHOWN: Final = 80


class OrderInvalid(ValueError):
    """Report why something is no command."""


@dataclass(frozen=True, slots=True, kw_only=True)
class CommandMessage:
    """Hold what a message asks for: words, a `plan` or a `mission`; `stated` is the JSON around."""

    text: str = ""
    plan: Any = None
    mission: dict[str, Any] | None = None
    stated: Mapping[str, Any] | None = None


def read_message(data: str) -> CommandMessage:
    """Return what a message asks for; nothing of it is judged but its form.

    Raises:
        OrderInvalid: it is empty, too long, no text, or JSON that holds neither words nor a plan.
    """
    size = len(data.encode(errors="replace"))
    if size > MOST_BYTES:
        raise OrderInvalid(f"expected at most {MOST_BYTES} bytes, got {size}; say less at a time")
    if data.strip()[:1] in ("{", "["):
        _check_letters(data)
        return _read_json(data.strip())
    return CommandMessage(text=checked_text(data))


def parsed_plan(text: str) -> dict[str, Any] | list[Any]:
    """Return a plan's JSON.

    Raises:
        OrderInvalid: it is no JSON object or list.
    """
    plan = _parsed(text, "the plan is no JSON")
    if not isinstance(plan, dict | list):
        raise OrderInvalid(f"the plan: expected an object or a list, got {type(plan).__name__}")
    return plan


def is_mission(document: Any) -> bool:
    """Return whether JSON is a mission: it has objectives, as no plan has."""
    return isinstance(document, dict) and isinstance(document.get("objectives"), list | dict)


def checked_text(data: str) -> str:
    """Return words without the blanks around them.

    Raises:
        OrderInvalid: there are none, or too many, or something that is no letter.
    """
    text = data.strip()
    if not text:
        raise OrderInvalid("expected words, got nothing")
    if len(text) > MOST_CHARACTERS:
        raise OrderInvalid(
            f"expected at most {MOST_CHARACTERS} characters of words, got {len(text)}; "
            "say less at a time"
        )
    _check_letters(text)
    return text


def is_stop_word(text: str) -> bool:
    """Return whether a text is a bare word to stop by, which nothing may keep from the planner."""
    return text.lower().strip(" .!") in STOP_WORDS


def shown(data: str) -> str:
    """Return a message as an answer to it may show it: short, and without control characters."""
    plain = "".join(letter if _is_plain(letter) else "?" for letter in data[: _SHOWN + 1])
    return plain if len(data) <= _SHOWN else f"{plain[:_SHOWN]}..."


def _check_letters(data: str) -> None:
    strange = next((one for one in data if not _is_plain(one) and one not in _BLANKS), None)
    if strange is not None:
        raise OrderInvalid(f"expected letters, got the control character U+{ord(strange):04X}")


def _is_plain(letter: str) -> bool:
    return unicodedata.category(letter) not in ("Cc", "Cs")


def _parsed(text: str, fault: str) -> Any:
    try:
        return json.loads(text, parse_constant=_refuse_constant)
    except RecursionError:
        raise OrderInvalid("the JSON is nested too deeply") from None
    except ValueError as error:
        raise OrderInvalid(f"{fault}: {error}") from error


def _read_json(text: str) -> CommandMessage:
    found = _parsed(text, f"expected JSON, as it begins with {text[0]!r}")
    if isinstance(found, list):
        if not found:
            raise OrderInvalid("expected a plan of one action or more, got an empty list")
        return CommandMessage(plan=found)
    if is_mission(found):
        return CommandMessage(mission=found, stated=found)
    if isinstance(found.get("plan"), dict):
        return CommandMessage(plan=found["plan"], stated=found)
    if any(isinstance(found.get(key), list) for key in PLAN_KEYS):
        return CommandMessage(plan=found, stated=found)
    for key in WORDS_KEYS:
        if isinstance(found.get(key), str) and found[key].strip():
            return CommandMessage(text=checked_text(found[key]), stated=found)
    raise OrderInvalid(
        f"expected words under one of {', '.join(WORDS_KEYS)}, or a list of actions under one of "
        f"{', '.join(PLAN_KEYS)}, or objectives; "
        f"got the keys {', '.join(map(repr, list(found)[:8])) or 'none'}"
    )


def _refuse_constant(name: str) -> float:
    raise ValueError(f"{name} is no number of JSON")
