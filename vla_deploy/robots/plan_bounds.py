"""Bound what plans may ask of one robot, as its file declares it."""

import math
from dataclasses import dataclass
from enum import StrEnum
from typing import Final


class Confirm(StrEnum):
    """Say which plans wait for a person's yes before anything moves."""

    NEVER = "never"
    RISKY = "risky"
    ALWAYS = "always"


@dataclass(frozen=True, slots=True, kw_only=True)
class PlanBounds:
    """Bound what a plan may ask of the robot.

    `payload_kg` is what one hand may carry.
    """

    payload_kg: float = math.inf
    max_actions: int = 100
    max_duration_s: float = 3600.0
    require_confirmation: Confirm = Confirm.RISKY


NOT_BOUNDED: Final = PlanBounds()
