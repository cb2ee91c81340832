"""Feel what a hand holds: opening, goal, effort and speed of its fingers, a pure step at a time.

A hand that was told to close further than its fingers are, that presses, and whose fingers stand
still, has something between them. Fingers that then close further without being told to are losing
it. What slides along the fingers without changing their opening cannot be felt this way.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Final

from drivers.clock import NS_PER_S

# Fingers on a thing stop this far short of their goal and press at least so much of their stall.
SHORT_M: Final = 0.003
PRESSING_RATIO: Final = 0.05
STILL_M_S: Final = 0.004
SETTLE_S: Final = 0.10
# More than the pads' give and the servo's noise.
DRIFT_M: Final = 0.002
# An effort below the threshold for longer than this is no gap between two measurements.
SLACK_S: Final = 0.20
OPENED_M: Final = 0.002
# A goal that moves less between two samples stands.
RISE_M: Final = 0.00005
# What a felt width may differ from the thing's own.
FITS_M: Final = 0.020


class Grip(StrEnum):
    """Name what the fingers feel."""

    UNKNOWN = "unknown"
    EMPTY = "empty"
    CLOSING = "closing"
    HOLDING = "holding"
    SLIPPING = "slipping"
    LOST = "lost"


OPENED: Final = "the hand was opened"
HELD: Final = frozenset({Grip.HOLDING, Grip.SLIPPING})


@dataclass(frozen=True, slots=True, kw_only=True)
class FingerSample:
    """Hold one measurement of a gripper; `speed_m_s` is positive when the fingers open.

    `closing_ratio` is the effort that closes them, as a share of the servo's stall torque.
    """

    stamp_ns: int
    opening_m: float
    goal_m: float
    speed_m_s: float
    closing_ratio: float
    is_powered: bool = True


@dataclass(frozen=True, slots=True, kw_only=True)
class Touch:
    """Hold what is felt since `since_ns`.

    `width_m` is that of what is held, `drift_m` how far the fingers have closed on it since, and
    `cause` how a hold ended.
    """

    grip: Grip = Grip.UNKNOWN
    since_ns: int = 0
    width_m: float = 0.0
    drift_m: float = 0.0
    closing_ratio: float = 0.0
    cause: str = ""
    goal_m: float = 0.0
    pressed_ns: int = 0
    settled_ns: int = 0
    raised_ns: int = 0

    @property
    def is_held(self) -> bool:
        """Return whether something is between the fingers."""
        return self.grip in HELD

    def fits(self, size_m: tuple[float, float, float]) -> bool:
        """Return whether what is felt is as wide as one of a thing's sides across the floor."""
        return min(abs(self.width_m - side_m) for side_m in size_m[:2]) <= FITS_M


def feel(before: Touch, sample: FingerSample) -> Touch:
    """Return what is felt after one more measurement."""
    numbers = (sample.opening_m, sample.goal_m, sample.speed_m_s, sample.closing_ratio)
    if not all(map(math.isfinite, numbers)):
        return _become(before, Grip.UNKNOWN, sample, cause="the fingers tell nothing")
    if not sample.is_powered:
        return _become(before, Grip.UNKNOWN, sample, cause="the fingers have no power")
    now = _pressed(replace(before, closing_ratio=sample.closing_ratio), sample)
    return _while_held(now, sample) if before.is_held else _while_empty(now, sample)


def _while_held(now: Touch, sample: FingerSample) -> Touch:
    short_m = sample.opening_m - sample.goal_m
    if sample.goal_m > now.goal_m + OPENED_M:
        opened = _become(now, Grip.EMPTY, sample, cause=OPENED)
        return replace(opened, goal_m=sample.goal_m, raised_ns=sample.stamp_ns)
    if short_m <= SHORT_M:
        return _become(now, Grip.LOST, sample, cause="it slipped out: the fingers have closed")
    if _since_s(now.pressed_ns, sample) > SLACK_S:
        return _become(now, Grip.LOST, sample, cause="it is gone: the fingers press on nothing")
    now = replace(
        now, drift_m=now.width_m - sample.opening_m, goal_m=min(now.goal_m, sample.goal_m)
    )
    if now.drift_m <= DRIFT_M:
        return replace(now, settled_ns=sample.stamp_ns)
    if _since_s(now.settled_ns, sample) > SETTLE_S:
        return _hold(now, sample)  # a soft or tapered thing that has come to rest again
    return _become(now, Grip.SLIPPING, sample)


def _while_empty(now: Touch, sample: FingerSample) -> Touch:
    short_m = sample.opening_m - sample.goal_m
    is_pressing = now.pressed_ns == sample.stamp_ns
    presses_on = is_pressing and _since_s(now.settled_ns, sample) >= SETTLE_S
    if now.cause == OPENED and sample.goal_m >= now.goal_m - OPENED_M:
        # The fingers follow a goal that rises: they are behind it, and press no more on purpose.
        rises = sample.goal_m > now.goal_m + RISE_M
        raised_ns = sample.stamp_ns if rises else now.raised_ns
        now = replace(now, goal_m=max(now.goal_m, sample.goal_m), raised_ns=raised_ns)
        # A goal that stands again before it has let go, as of a control that started anew, did not.
        presses_on = presses_on and _since_s(raised_ns, sample) >= SETTLE_S
        if not presses_on:
            return now
    if presses_on:
        return _hold(now, sample)
    if now.grip is Grip.LOST and abs(sample.goal_m - now.goal_m) <= OPENED_M:
        return now  # until the hand is used again
    if short_m > SHORT_M:
        return _become(now, Grip.CLOSING, sample)
    return _become(now, Grip.EMPTY, sample)


def _pressed(now: Touch, sample: FingerSample) -> Touch:
    """Note when the fingers pressed last, and since when they have stood still doing so."""
    is_short = sample.opening_m - sample.goal_m > SHORT_M
    is_pressing = is_short and sample.closing_ratio > PRESSING_RATIO
    is_still = is_pressing and abs(sample.speed_m_s) < STILL_M_S
    return replace(
        now,
        pressed_ns=sample.stamp_ns if is_pressing else now.pressed_ns,
        settled_ns=now.settled_ns if is_still else sample.stamp_ns,
    )


def _hold(now: Touch, sample: FingerSample) -> Touch:
    held = _become(now, Grip.HOLDING, sample)
    return replace(held, width_m=sample.opening_m, drift_m=0.0, goal_m=sample.goal_m)


def _become(now: Touch, grip: Grip, sample: FingerSample, cause: str = "") -> Touch:
    since_ns = now.since_ns if grip is now.grip else sample.stamp_ns
    return replace(now, grip=grip, since_ns=since_ns, cause=cause)


def _since_s(then_ns: int, sample: FingerSample) -> float:
    return (sample.stamp_ns - then_ns) / NS_PER_S


def is_denied(hand: Mapping[str, object] | None, told: str | None) -> bool:
    """Return whether the fingers are sure not to hold what is told that they hold.

    `hand` is as the scene tells it; a scene that does not know yet what is told denies nothing.
    """
    if hand is None or not told or hand.get("told") != told:
        return False
    return bool(hand.get("confirmed")) and not hand.get("class")
