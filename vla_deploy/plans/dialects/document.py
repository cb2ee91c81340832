"""Find the plan in what an author wrote: JSON, also within prose, wrapped, or one action alone."""

import json
import re
from collections.abc import Mapping
from typing import Any, Final

from vla_deploy.plans.dialects.values import Json
from vla_deploy.plans.errors import PlanInvalid

LISTS: Final = ("actions", "action_sequence", "plan", "steps", "primitives", "recovery_actions")
_NAMED_BY: Final = ("skill", "action", "action_type")
_DECODER: Final = json.JSONDecoder()
_BEGINNING: Final = re.compile(r"[{[]")
# Each may cost the parser a look at the whole text.
_MOST_BEGINNINGS: Final = 64
_DEEPEST: Final = 16
_MOST_VALUES: Final = 20_000


def plan_document(document: Any) -> Json:
    """Return an author's plan as an object with a list of actions under one of `LISTS`.

    Raises:
        PlanInvalid: there is none in it.
    """
    found = _json_in(document) if isinstance(document, str) else document
    _check_size(found)
    if isinstance(found, list):
        return {"actions": found}
    if not isinstance(found, Mapping):
        raise PlanInvalid([f"a plan is a JSON object or a list of actions, got {found!r:.60}"])
    inner = found.get("plan")
    if isinstance(inner, Mapping):
        around = {key: value for key, value in found.items() if key != "plan"}
        twice = {key: f"{key} around the plan" for key in around if key in inner}
        return {**{twice.get(key, key): value for key, value in around.items()}, **inner}
    is_action = isinstance(next((found[one] for one in _NAMED_BY if one in found), None), str)
    if is_action and not any(isinstance(found.get(key), list) for key in LISTS):
        return {"actions": [dict(found)]}
    return dict(found)


def _json_in(text: str) -> Any:
    """Return the first JSON object or list in a text; what is broken is skipped whole."""
    start = 0
    for _ in range(_MOST_BEGINNINGS):
        beginning = _BEGINNING.search(text, start)
        if beginning is None:
            break
        try:
            return _DECODER.raw_decode(text, beginning.start())[0]
        except json.JSONDecodeError as error:
            start = max(error.pos, beginning.end())
        except RecursionError:
            raise PlanInvalid(["the JSON is nested too deeply"]) from None
    raise PlanInvalid(["no JSON object found in the text"])


def _check_size(document: Any) -> None:
    """Refuse what is too deep or too large to be a plan, and texts that are none.

    Raises:
        PlanInvalid: it is.
    """
    left, count = [(document, 0)], 0
    while left:
        value, depth = left.pop()
        count += 1
        if depth > _DEEPEST:
            raise PlanInvalid(
                [f"the JSON is nested too deeply: expected {_DEEPEST} levels at most"]
            )
        if count > _MOST_VALUES:
            raise PlanInvalid([f"the plan is too long: expected {_MOST_VALUES} values at most"])
        if isinstance(value, Mapping):
            left += [(one, depth + 1) for pair in value.items() for one in pair]
        elif isinstance(value, list | tuple):
            left += [(one, depth + 1) for one in value]
        elif isinstance(value, str) and not _is_text(value):
            raise PlanInvalid([f"a text of the plan has characters that are none: {value!a:.40}"])


def _is_text(value: str) -> bool:
    try:
        value.encode()
    except UnicodeEncodeError:  # half of a surrogate pair
        return False
    return True
