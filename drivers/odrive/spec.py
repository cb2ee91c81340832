"""Declare what the robot file says about one ODrive axis."""

import math
from dataclasses import dataclass

from drivers.odrive.codec import MAX_NODE_ID


@dataclass(frozen=True, slots=True, kw_only=True)
class AxisSpec:
    """Describe one axis; `sign` is -1 where its positive direction turns the joint backwards.

    `gear_ratio` is motor turns per joint turn. Without a current limit the axis keeps both limits
    that are stored in it.

    Raises:
        ValueError: a value is out of its range.
    """

    node_id: int
    joint: str
    sign: int = 1
    gear_ratio: float = 1.0
    acceleration_rad_s2: float = 20.0
    velocity_limit_rad_s: float = 40.0
    current_limit_a: float | None = None

    def __post_init__(self) -> None:
        current_a = self.current_limit_a
        checks = (
            ("node_id", 0 <= self.node_id <= MAX_NODE_ID, f"0..{MAX_NODE_ID}"),
            ("sign", self.sign in (-1, 1), "-1 or 1"),
            ("gear_ratio", self.gear_ratio > 0.0, "above 0"),
            ("acceleration_rad_s2", self.acceleration_rad_s2 > 0.0, "above 0"),
            ("velocity_limit_rad_s", self.velocity_limit_rad_s > 0.0, "above 0"),
            ("current_limit_a", current_a is None or current_a > 0.0, "above 0"),
        )
        for name, valid, allowed in checks:
            if not valid:
                raise ValueError(f"axis {self.joint}: {name} {getattr(self, name)}, not {allowed}")

    @property
    def name(self) -> str:
        """Return what the axis is called in messages."""
        return f"axis {self.joint} (node {self.node_id})"

    @property
    def revs_per_rad(self) -> float:
        """Return motor turns per joint radian, with the sign of the mounting."""
        return self.sign * self.gear_ratio / math.tau
