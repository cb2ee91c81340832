"""Lay `overrides.toml` over the robot file of the same folder: what differs on this one robot."""

import tomllib
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

from vla_deploy.robots.schema import RobotFileFault

OVERRIDES_FILE: Final = "overrides.toml"
Document = Mapping[str, Any]


def read_overrides(directory: Path) -> tuple[Document, tuple[RobotFileFault, ...]]:
    """Return the overrides of a robot's folder, empty where it has none, and the file's faults."""
    try:
        text = (directory / OVERRIDES_FILE).read_text(encoding="utf-8")
        return tomllib.loads(text), ()
    except FileNotFoundError:
        return {}, ()
    except (OSError, tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        return {}, (
            RobotFileFault(key=f"{OVERRIDES_FILE}: (file)", got=str(error), expected="a TOML file"),
        )


def traced(fault: RobotFileFault, overrides: Document, own: Document) -> RobotFileFault:
    """Return the fault of a merged document, with the name of the overrides where they made it.

    A value that lacks in a table is theirs where the robot file itself has no such table.
    """
    above: Any = overrides
    below: Any = own
    for part in fault.key.partition("[")[0].split("."):
        if not isinstance(above, dict):
            break  # a value of theirs, in which something is wrong
        if part not in above:
            if above is not overrides and not isinstance(below, dict):
                break
            return fault
        above = above[part]
        below = below.get(part) if isinstance(below, dict) else None
    return replace(fault, key=f"{OVERRIDES_FILE}: {fault.key}")
