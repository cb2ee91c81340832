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
    lasts as long as it was asked for. `map_bounds_m` are the least x and y and the most x and y (m)
    of the map where the robot is sent to.
    """

    payload_kg: float = math.inf
    max_actions: int = 100
    max_duration_s: float = 3600.0
    require_confirmation: Confirm = Confirm.RISKY
    further_plans: int = 3
    action_timeout_s: float = math.inf
    map_bounds_m: tuple[float, float, float, float] = (-math.inf, -math.inf, math.inf, math.inf)

    def holds(self, x_m: float, y_m: float) -> bool:
        """Return whether a point of the map is within the bounds."""
        low_x_m, low_y_m, high_x_m, high_y_m = self.map_bounds_m
        return low_x_m <= x_m <= high_x_m and low_y_m <= y_m <= high_y_m


NOT_BOUNDED: Final = PlanBounds()
