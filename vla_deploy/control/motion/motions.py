"""Move every joint's setpoint along the motions that are active, and say how each one ended.

A new motion takes over the joints it names; a motion that loses any of its joints ends as
cancelled, and the joints it keeps ramp to rest. Time is handed in per tick and bounded by the
caller, so that a late tick delays a motion instead of making it jump.
"""

from dataclasses import dataclass
from enum import Enum
from typing import Protocol

import numpy as np

from vla_deploy.control.motion.axes import Axes, AxesState, AxisLimits, Flags, Floats
from vla_deploy.control.motion.profile_motion import plan_stop
from vla_deploy.control.motion.touch_guard import TouchGuard


class Curve(Protocol):
    """Hold where some axes shall be at a time."""

    duration_s: float

    def sample(self, elapsed_s: float) -> AxesState:
        """Return the state `elapsed_s` after the start."""
        ...


class Ending(Enum):
    """Name how a motion ended."""

    DONE = "done"
    CANCELLED = "cancelled"
    REFUSED = "refused"
    STOPPED = "stopped"
    TOUCHED = "touched"


@dataclass(frozen=True, slots=True, kw_only=True)
class MotionResult:
    """Hold how one motion ended and why."""

    motion_id: int
    ending: Ending
    reason: str = ""


@dataclass(slots=True, eq=False)
class _Motion:
    """Carry one active motion; a ramp to rest that nobody asked for has no id."""

    motion_id: int | None
    axes: Axes
    curve: Curve
    elapsed_s: float = 0.0
    guard: TouchGuard | None = None


class MotionSet:
    """Hold the setpoint state of all joints and the motions that move it."""

    def __init__(self, limits: AxisLimits) -> None:
        count = len(limits.velocity)
        self._limits = limits
        self._motions: list[_Motion] = []
        self.state = AxesState(
            position=np.zeros(count), velocity=np.zeros(count), acceleration=np.zeros(count)
        )

    @property
    def active_ids(self) -> list[int]:
        """Return the ids of the motions under way."""
        return [m.motion_id for m in self._motions if m.motion_id is not None]

    @property
    def at_rest(self) -> bool:
        """Return whether no joint's setpoint moves."""
        return not self._motions

    def place(self, position: Floats, joints: Flags) -> None:
        """Put the setpoints of joints that hold nothing at rest on their measured position."""
        np.copyto(self.state.position, position, where=joints)
        self.state.velocity[joints] = 0.0
        self.state.acceleration[joints] = 0.0

    def start(
        self, motion_id: int, axes: Axes, curve: Curve, guard: TouchGuard | None = None
    ) -> list[MotionResult]:
        """Begin a motion from the present state and return the motions that lost joints to it."""
        taken = set(axes.tolist())
        losers = [m for m in self._motions if not taken.isdisjoint(m.axes.tolist())]
        results = self._end(losers, Ending.CANCELLED, f"motion {motion_id} took over its joints")
        for loser in losers:
            self._ramp(np.array([a for a in loser.axes if a not in taken], dtype=np.intp))
        self._motions.append(_Motion(motion_id, axes, curve, guard=guard))
        return results

    def cancel(self, motion_id: int) -> list[MotionResult]:
        """Ramp one motion's joints to rest; nothing happens when it has ended already."""
        cancelled = [m for m in self._motions if m.motion_id == motion_id]
        results = self._end(cancelled, Ending.CANCELLED, "cancelled on request")
        for motion in cancelled:
            self._ramp(motion.axes)
        return results

    def feel(self, external_torque_nm: Floats) -> list[MotionResult]:
        """Ramp to rest the joints of motions that feel their way and have met something."""
        results = []
        for motion in list(self._motions):
            touch = motion.guard.touch(external_torque_nm[motion.axes]) if motion.guard else ""
            if touch:
                results += self._end([motion], Ending.TOUCHED, touch)
                self._ramp(motion.axes)
        return results

    def stop(self, reason: str) -> list[MotionResult]:
        """Ramp every joint to rest and end every motion as stopped."""
        results = self._end(list(self._motions), Ending.STOPPED, reason)
        moving = (self.state.velocity != 0.0) | (self.state.acceleration != 0.0)
        self._ramp(np.flatnonzero(moving))
        return results

    def advance(self, period_s: float) -> list[MotionResult]:
        """Move the setpoints on by one period and return the motions that are done."""
        finished = []
        for motion in self._motions:
            motion.elapsed_s += period_s
            sample = motion.curve.sample(motion.elapsed_s)
            self.state.position[motion.axes] = sample.position
            self.state.velocity[motion.axes] = sample.velocity
            self.state.acceleration[motion.axes] = sample.acceleration
            if motion.elapsed_s >= motion.curve.duration_s:
                finished.append(motion)
        return self._end(finished, Ending.DONE, "") if finished else []

    def _ramp(self, axes: Axes) -> None:
        if len(axes) > 0:
            curve = plan_stop(self.state.of(axes), self._limits.of(axes))
            self._motions.append(_Motion(None, axes, curve))

    def _end(self, motions: list[_Motion], ending: Ending, reason: str) -> list[MotionResult]:
        for motion in motions:
            self._motions.remove(motion)
        return [
            MotionResult(motion_id=m.motion_id, ending=ending, reason=reason)
            for m in motions
            if m.motion_id is not None
        ]
