"""Write values as TOML; Python's library only reads it."""

import json
import re
from collections.abc import Mapping
from typing import Any


def toml_lines(table: Mapping[str, Any]) -> str:
    """Return a table, a line for each key; tables in it stand on their key's line."""
    return "".join(f"{_key(key)} = {toml_value(value)}\n" for key, value in table.items())


def toml_value(value: Any) -> str:
    """Return a value as `tomllib` reads it, on one line."""
    if isinstance(value, Mapping):
        rows = (f"{_key(key)} = {toml_value(one)}" for key, one in value.items())
        return f"{{{', '.join(rows)}}}"
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(toml_value, value))}]"
    if isinstance(value, str | bool | int | float):
        return json.dumps(value, ensure_ascii=False)
    return str(value)  # a date, as tomllib reads it


def _key(key: str) -> str:
    return key if re.fullmatch(r"[A-Za-z0-9_-]+", key) else json.dumps(key, ensure_ascii=False)
