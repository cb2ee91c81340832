"""Watch that the robot comes to rest after a kill, and that nothing then moves before a hand."""

import math
from collections.abc import Iterator, Mapping
from typing import Any, Final

from sim_twin.campaigns.killing.rules import KillRule
from sim_twin.physics.truth import fastest_joint

_REST_FOR_S: Final = 0.3
STILL_RAD: Final = 0.05
"""An arm may give in this far to where a control that came back holds it."""


class RestWatch:
    """Keep when rest began for good, and how far anything moved after it.

    `rest_s` is NaN where the rule lets the robot carry on.
    """

    def __init__(self, rule: KillRule) -> None:
        self.rule = rule
        self.rest_s = math.nan if rule.rest_s is None else math.inf
        self.least_s = 0.0 if rule.rest_s is None else rule.rest_s + _REST_FOR_S
        self.moved_rad = 0.0
        self._mover = ""
        self._shifted = ""
        self._places: Mapping[str, float] = {}

    def wants(self, since_s: float) -> bool:
        """Return whether it matters what moves so long after the kill."""
        return since_s < self.least_s or (self.rule.stays and math.isfinite(self.rest_s))

    def look(self, since_s: float, truth: Mapping[str, Any]) -> None:
        """Look once at what the physics knows."""
        places = {name: float(joint["position"]) for name, joint in truth["joints"].items()}
        if since_s >= self.least_s:
            self._compare(places)
            return
        joint, speed_rad_s = fastest_joint(truth)
        if speed_rad_s > self.rule.rest_rad_s:
            self.rest_s = math.inf
            where = f"at {places[joint]:.3f} rad, after {since_s:.1f} s"
            self._mover = f"{joint} moves at {speed_rad_s:.2g} rad/s, {where}"
        elif math.isinf(self.rest_s):
            self.rest_s, self._places = since_s, places

    def failures(self) -> Iterator[str]:
        """Return that it rested too late, or moved after it."""
        limit_s = self.rule.rest_s
        if limit_s is not None and not self.rest_s <= limit_s:
            yield f"at rest after {self.rest_s:.2f} s, limit {limit_s:g} s ({self._mover})"
        if self.moved_rad > STILL_RAD:
            yield f"{self._shifted} moved by {self.moved_rad:.3f} rad before a hand let it"

    def _compare(self, places: Mapping[str, float]) -> None:
        ways = {name: abs(place - self._places[name]) for name, place in places.items()}
        name, way_rad = max(ways.items(), key=lambda item: item[1])
        if way_rad > self.moved_rad:
            self._shifted, self.moved_rad = name, way_rad
