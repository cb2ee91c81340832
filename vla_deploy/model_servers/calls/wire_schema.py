"""Reduce a JSON Schema to what every server's constrained decoding understands.

Bounds of numbers, lengths and texts are left out: where a server knows them not, it refuses the
whole request. They are checked when the answer has come.
"""

from collections.abc import Mapping
from typing import Any, Final

_KEPT: Final = frozenset({"type", "enum", "const", "description", "$ref", "required"})
_LISTS: Final = ("anyOf",)
_NAMED: Final = ("properties", "$defs")


def wire_schema(schema: Mapping[str, Any]) -> dict[str, Any]:
    """Return a schema whose objects are closed and have all their properties."""
    reduced = {key: value for key, value in schema.items() if key in _KEPT}
    for key in _NAMED:
        if key in schema:
            reduced[key] = {name: wire_schema(inner) for name, inner in schema[key].items()}
    for key in _LISTS:
        if key in schema:
            reduced[key] = [wire_schema(inner) for inner in schema[key]]
    items = schema.get("items")
    if isinstance(items, Mapping):
        reduced["items"] = wire_schema(items)
    if "properties" in schema:
        reduced["required"] = list(schema["properties"])
        reduced["additionalProperties"] = False
    return reduced


def is_closed(schema: Mapping[str, Any]) -> bool:
    """Return whether every object of a reduced schema names its properties, for strict modes."""
    if schema.get("type") == "object" and "properties" not in schema:
        return False
    inner = [one for key in _NAMED for one in schema.get(key, {}).values()]
    inner += [one for key in _LISTS for one in schema.get(key, ())]
    inner += [schema["items"]] if "items" in schema else []
    return all(map(is_closed, inner))
