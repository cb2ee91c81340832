"""Judge distances of bodies where they will be once the joints have come to rest: pure arithmetic.

What counts is the pose one braking distance ahead, reckoned from measured positions and
velocities: a setpoint says nothing about a joint that is pushed or falls.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vla_deploy.safety.surroundings import Clearance, Excess

Floats = NDArray[np.float64]

# Below this share of its top speed a joint counts as standing: servos tell speed in coarse steps.
STANDING_SHARE = 0.03
# A gap that closes slower than this does not close: it is the play of the distances themselves.
CLOSING_M_S = 0.005


@dataclass(frozen=True, slots=True, kw_only=True)
class JointBounds:
    """Carry what bounds the joints' way to standstill."""

    lower: Floats
    upper: Floats
    velocity: Floats
    acceleration: Floats
    reaction_s: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Stopping:
    """Carry the pose in which the joints come to rest, and how long the slowest one takes."""

    position: Floats
    time_s: float


def stopping(position: Floats, velocity: Floats, bounds: JointBounds) -> Stopping:
    """Return where the joints come to rest if they brake after the reaction time."""
    moving = np.abs(velocity) > STANDING_SHARE * bounds.velocity
    speed = np.where(moving, velocity, 0.0)
    way = speed * bounds.reaction_s + speed * np.abs(speed) / (2.0 * bounds.acceleration)
    low, high = np.minimum(bounds.lower, position), np.maximum(bounds.upper, position)
    braking_s = float((np.abs(speed) / bounds.acceleration).max())
    return Stopping(
        position=np.clip(position + way, low, high), time_s=bounds.reaction_s + braking_s
    )


def nearest_pair(
    pairs: Sequence[tuple[str, str]], now_m: Floats, ahead_m: Floats, time_s: float
) -> Clearance | None:
    """Return the pair that comes nearest; pairs that close their gap go before all others.

    Its distance is the one ahead, its rate the mean on the way there.
    """
    if len(pairs) == 0:
        return None
    rate = (now_m - ahead_m) / time_s
    closing = rate > CLOSING_M_S
    among = np.where(closing, ahead_m, np.inf) if closing.any() else ahead_m
    worst = int(among.argmin())
    first, second = pairs[worst]
    return Clearance(
        first=first,
        second=second,
        distance_m=float(ahead_m[worst]),
        closing_m_s=float(rate[worst]) if closing[worst] else 0.0,
    )


def beyond_box(
    names: Sequence[str], now: Floats, ahead: Floats, low: Floats, high: Floats, time_s: float
) -> Excess | None:
    """Return which point, (n, 3), ends up furthest outside its box; None while all stay inside.

    A point that is on its way out goes before those that stay or come back.
    """
    if len(names) == 0:
        return None
    excess_now, excess_ahead = _outside(now, low, high), _outside(ahead, low, high)
    rate = (excess_ahead - excess_now) / time_s
    leaving = rate > CLOSING_M_S
    among = np.where(leaving, excess_ahead, -np.inf) if leaving.any() else excess_ahead
    worst = int(among.argmax())
    if excess_ahead[worst] <= 0.0:
        return None
    return Excess(
        subject=names[worst],
        excess_m=float(excess_ahead[worst]),
        rate_m_s=float(rate[worst]),
    )


def _outside(points: Floats, low: Floats, high: Floats) -> Floats:
    worst: Floats = np.maximum(low - points, points - high).max(axis=1)
    return np.maximum(worst, 0.0)
