"""Say what the digital twin of a robot shows when nobody asks for anything else."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final


@dataclass(frozen=True, slots=True, kw_only=True)
class TwinSettings:
    """Name the twin's `world`, and the command that `vla-deploy demo` gives there."""

    world: str = "flat"
    demo: str = "pick up the red cup and put it in the box"


USUAL_TWIN: Final = TwinSettings()
_ON_A_TABLE: Final = {"world": "table", "demo": "put the red block into the bowl"}
_BLIND: Final = {"world": "table", "demo": "open the gripper"}


def twin_settings(document: Mapping[str, Any]) -> TwinSettings:
    """Return what a robot file says, or what suits a robot that drives, or one on a table."""
    usual: Mapping[str, str] = {}
    if "base" not in document:
        usual = _ON_A_TABLE if "camera" in document and "hands" in document else _BLIND
    return TwinSettings(**{**usual, **document.get("twin", {})})
