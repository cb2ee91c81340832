"""Turn velocities of the base into wheel speeds and back, for each kind of base."""

from dataclasses import dataclass
from math import cos, sin
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from vla_deploy.control.motion.base_velocity import BaseVelocity
from vla_deploy.robots.description import BaseGeometry


class BaseKinematics(Protocol):
    """Know how the wheels of a base turn when it moves; angles and ways obey the same rule."""

    def wheel_speeds(
        self, v_m_s: float, w_rad_s: float, left_m_s: float = 0.0
    ) -> tuple[float, ...]:
        """Return each wheel's speed in rad/s for a base velocity."""
        ...

    def base_velocity(self, *wheels_rad_s: float) -> BaseVelocity:
        """Return the velocity that fits the wheels' speeds best."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class DifferentialDrive:
    """Carry a differential drive's wheel radius and the distance between its wheels."""

    wheel_radius_m: float
    track_m: float

    def wheel_speeds(
        self, v_m_s: float, w_rad_s: float, left_m_s: float = 0.0
    ) -> tuple[float, ...]:
        """Return left and right wheel speed in rad/s; sideways it cannot go."""
        turn = 0.5 * self.track_m * w_rad_s
        return (v_m_s - turn) / self.wheel_radius_m, (v_m_s + turn) / self.wheel_radius_m

    def base_velocity(self, *wheels_rad_s: float) -> BaseVelocity:
        """Return forward and turning velocity for the speeds of the left and the right wheel."""
        left, right = (one * self.wheel_radius_m for one in wheels_rad_s)
        return BaseVelocity(0.5 * (left + right), (right - left) / self.track_m)


class OmniDrive:
    """Be wheels that roll along the base's rim and slip along their axles, which point outwards.

    A wheel at bearing b rolls in the direction (-sin b, cos b), counter-clockwise around the base
    where its speed is positive. More wheels than three contradict each other a little; the base
    then moves by the least squares of what they say.
    """

    def __init__(
        self, *, wheel_radius_m: float, base_radius_m: float, bearings_rad: tuple[float, ...]
    ) -> None:
        rows = [(-sin(one), base_radius_m, cos(one)) for one in bearings_rad]
        matrix = np.array(rows) / wheel_radius_m
        self._rows = _plain(matrix)
        self._inverse = _plain(np.linalg.pinv(matrix).astype(np.float64))

    def wheel_speeds(
        self, v_m_s: float, w_rad_s: float, left_m_s: float = 0.0
    ) -> tuple[float, ...]:
        """Return each wheel's speed in rad/s for a base velocity."""
        return tuple(a * v_m_s + b * w_rad_s + c * left_m_s for a, b, c in self._rows)

    def base_velocity(self, *wheels_rad_s: float) -> BaseVelocity:
        """Return the velocity that fits the wheels' speeds best."""
        return BaseVelocity(
            *(
                sum(part * one for part, one in zip(row, wheels_rad_s, strict=True))
                for row in self._inverse
            )
        )


def base_kinematics(base: BaseGeometry) -> BaseKinematics:
    """Return how the wheels of a robot's base turn."""
    if base.base_radius_m is None:
        assert base.track_m is not None, "the check of robot files lets no base through without"
        return DifferentialDrive(wheel_radius_m=base.wheel_radius_m, track_m=base.track_m)
    return OmniDrive(
        wheel_radius_m=base.wheel_radius_m,
        base_radius_m=base.base_radius_m,
        bearings_rad=base.wheel_bearings_rad,
    )


def within_wheels(
    velocity: BaseVelocity, kinematics: BaseKinematics, most_rad_s: float
) -> BaseVelocity:
    """Return a velocity on the same curve that asks no wheel for more than it may turn."""
    fastest = max(map(abs, kinematics.wheel_speeds(*velocity)))
    return velocity if fastest <= most_rad_s else velocity.times(most_rad_s / fastest)


def _plain(matrix: NDArray[np.float64]) -> list[tuple[float, ...]]:
    """Return rows of plain numbers: for three wheels arrays cost several times as much."""
    return [tuple(row) for row in matrix.tolist()]
