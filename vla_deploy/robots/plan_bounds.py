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

    `payload_kg` is what one hand may carry. After setbacks, so many `further_plans` are made for
    one command. `action_timeout_s` ends an action before the time-out of its skill does; waiting
    lasts as long as it was asked for.
    """

    payload_kg: float = math.inf
    max_actions: int = 100
    max_duration_s: float = 3600.0
    require_confirmation: Confirm = Confirm.RISKY
    further_plans: int = 3
    action_timeout_s: float = math.inf


NOT_BOUNDED: Final = PlanBounds()
