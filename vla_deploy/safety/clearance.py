"""Judge distances of bodies where they will be once the joints have come to rest: pure arithmetic.

What counts is the pose one braking distance ahead. It is reckoned from the setpoints, which know
whether a motion is braking already, and for a joint that does not follow them from where it is.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vla_deploy.safety.surroundings import Clearance, Excess

Floats = NDArray[np.float64]

# Below this share of its top speed a joint that does not follow its setpoint counts as standing:
# servos tell speed in coarse steps. Setpoints are exact.
STANDING_SHARE = 0.03
# A gap that closes slower than this does not close: it is the play of the distances themselves.
CLOSING_M_S = 0.005
# What rests on something when power comes may settle this much deeper.
PLAY_M = 0.003


@dataclass(frozen=True, slots=True, kw_only=True)
class JointBounds:
    """Carry what bounds the joints' way to standstill."""

    lower: Floats
    upper: Floats
    velocity: Floats
    acceleration: Floats
    jerk: Floats
    following: Floats
    reaction_s: float


@dataclass(frozen=True, slots=True, kw_only=True)
class JointMotion:
    """Carry how the joints move: `velocity` is measured, the others are the setpoints'."""

    position: Floats
    velocity: Floats
    setpoint: Floats
    setpoint_velocity: Floats
    setpoint_acceleration: Floats


@dataclass(frozen=True, slots=True, kw_only=True)
class StoppingMotion:
    """Carry from where and to where the joints come to rest; how long the slowest one takes."""

    start: Floats
    position: Floats
    time_s: float


def stopping(motion: JointMotion, bounds: JointBounds) -> StoppingMotion:
    """Return where the joints come to rest if they brake after the reaction time.

    The way of a jerk-limited stop is v^2 / 2a, and v / 2 times what it takes to begin braking. A
    joint that still gains speed gains more until its acceleration has gone, after the reaction.
    """
    follows = np.abs(motion.setpoint - motion.position) <= bounds.following
    start = np.where(follows, motion.setpoint, motion.position)
    velocity = np.where(follows, motion.setpoint_velocity, motion.velocity)
    acceleration = np.where(follows, motion.setpoint_acceleration, 0.0)
    moving = np.abs(velocity) > np.where(follows, 0.0, STANDING_SHARE * bounds.velocity)
    speed = np.where(moving, np.abs(velocity), 0.0)
    gain = _within(acceleration * np.sign(velocity), -bounds.acceleration, bounds.acceleration)
    onset_s = (bounds.acceleration + np.minimum(gain, 0.0)) / bounds.jerk
    gain, reaction_s = np.maximum(gain, 0.0), bounds.reaction_s
    fading_s = gain / bounds.jerk
    reached = speed + gain * reaction_s
    peak = reached + 0.5 * gain * fading_s
    braking_s = peak / bounds.acceleration
    gaining = reaction_s * (speed + 0.5 * gain * reaction_s)
    gaining += fading_s * (reached + gain * fading_s / 3.0)
    way = np.sign(velocity) * (gaining + peak * 0.5 * (onset_s + braking_s))
    low, high = np.minimum(bounds.lower, start), np.maximum(bounds.upper, start)
    slowest_s = float(np.where(moving, fading_s + onset_s + braking_s, 0.0).max())
    position = _within(start + way, low, high)
    return StoppingMotion(start=start, position=position, time_s=bounds.reaction_s + slowest_s)


def _within(values: Floats, low: Floats, high: Floats) -> Floats:
    """Do what numpy.clip does, in a third of its time."""
    return np.minimum(np.maximum(values, low), high)


def least_distances(least_m: Floats, start_m: Floats, limit_m: float, powered: bool) -> Floats:
    """Return how near each pair may come: the limit, and less for those that power found nearer.

    Those may stay and part, but a pair that has parted may not come as near again.
    """
    here: Floats = np.minimum(start_m - PLAY_M, limit_m)
    return np.maximum(here, least_m) if powered else here


def nearest_pair(
    pairs: Sequence[tuple[str, str]],
    start_m: Floats,
    ahead_m: Floats,
    least_m: Floats,
    time_s: float,
) -> Clearance | None:
    """Return the pair with the least to spare; pairs that close their gap go before all others.

    Its distance is the one ahead, its rate the mean on the way there.
    """
    if len(pairs) == 0:
        return None
    rate = (start_m - ahead_m) / time_s
    closing = rate > CLOSING_M_S
    spare_m = ahead_m - least_m
    among = np.where(closing, spare_m, np.inf) if closing.any() else spare_m
    worst = int(among.argmin())
    first, second = pairs[worst]
    return Clearance(
        first=first,
        second=second,
        distance_m=float(ahead_m[worst]),
        closing_m_s=float(rate[worst]) if closing[worst] else 0.0,
        least_m=float(least_m[worst]),
    )


def beyond_box(
    names: Sequence[str], start: Floats, ahead: Floats, low: Floats, high: Floats, time_s: float
) -> Excess | None:
    """Return which point, (n, 3), ends up furthest outside its box; None while all stay inside.

    A point that is on its way out goes before those that stay or come back.
    """
    if len(names) == 0:
        return None
    excess_start, excess_ahead = _outside(start, low, high), _outside(ahead, low, high)
    rate = (excess_ahead - excess_start) / time_s
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
