"""Read the schemas that viewers know: Foxglove's own files, kept word for word in `foxglove/`."""

import json
from functools import cache
from importlib.resources import files
from typing import Any, Final

PREFIX: Final = "foxglove."


@cache
def well_known(name: str) -> dict[str, Any]:
    """Return the JSON schema of a message such as `foxglove.LaserScan`.

    Raises:
        FileNotFoundError: it is not among those kept here.
    """
    file = files(__package__) / "foxglove" / f"{name.removeprefix(PREFIX)}.json"
    schema: dict[str, Any] = json.loads(file.read_text(encoding="utf-8"))
    return schema
