"""Say what the digital twin of a robot shows when nobody asks for anything else."""

from dataclasses import dataclass
from typing import Final


@dataclass(frozen=True, slots=True, kw_only=True)
class TwinSettings:
    """Name the twin's `world`, and the command that `vla-deploy demo` gives there."""

    world: str = "flat"
    demo: str = "pick up the red cup and put it in the box"


USUAL_TWIN: Final = TwinSettings()
