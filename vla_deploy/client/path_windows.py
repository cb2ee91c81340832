"""Cut a long path of joint positions into trajectories that control takes, each with its own end.

Control takes a few hundred points at a time and ends every trajectory at rest. So each window slows
down to rest along the path, and before it does the next one takes over at full speed: when the
sender ends, the joints come to rest on the path within a few seconds.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
WINDOW_S: Final = 2.0
"""Between two takeovers; a window goes on for a brake more."""
MARGIN_S: Final = 0.5
"""So long before the brake the next window takes over."""
RAMP_S: Final = 1.0
"""From rest to the path's own speed, and back."""
LEAD_S: Final = 0.1
"""From a takeover to the first point of the next window."""
MAX_POINTS_PER_S: Final = 60.0


@dataclass(frozen=True, slots=True, kw_only=True)
class TimedPath:
    """Hold positions, an array of frame by joint, and how many frames pass in a second."""

    joints: tuple[str, ...]
    positions: Floats
    frames_per_s: float

    @property
    def last(self) -> int:
        """Return the number of the last frame."""
        return len(self.positions) - 1

    def thinned(self) -> "TimedPath":
        """Return the path with no more frames a second than a trajectory has room for."""
        step = int(np.ceil(self.frames_per_s / MAX_POINTS_PER_S))
        if step <= 1:
            return self
        chosen = np.arange(0, len(self.positions), step)
        if chosen[-1] != self.last:
            chosen[-1] = self.last  # at most a step early: nowhere else does it end
        return TimedPath(
            joints=self.joints,
            positions=self.positions[chosen],
            frames_per_s=self.frames_per_s / step,
        )

    def at(self, frame: float) -> Floats:
        """Return the positions between two frames."""
        low = min(int(frame), max(self.last - 1, 0))
        high = min(low + 1, self.last)
        part = min(frame - low, 1.0)
        between: Floats = (1.0 - part) * self.positions[low] + part * self.positions[high]
        return between

    def velocity_at(self, frame: int) -> Floats:
        """Return the velocity at a frame, from its neighbours."""
        before, after = max(frame - 1, 0), min(frame + 1, self.last)
        step: Floats = self.positions[after] - self.positions[before]
        return step * self.frames_per_s / max(after - before, 1)


@dataclass(frozen=True, kw_only=True)
class PathWindow:
    """Say when each of some frames is passed, in seconds from the first of them."""

    path: TimedPath
    begins: int
    brakes: int
    ends: int
    from_rest: bool

    @cached_property
    def times_s(self) -> Floats:
        """Return the moment of each frame: faster and faster, steady, slower and slower."""
        rate = self.path.frames_per_s
        braking = self.ends - self.brakes
        starting = min(braking, self.brakes - self.begins) if self.from_rest else 0
        at = np.arange(self.ends - self.begins + 1, dtype=np.float64)
        times = (at + starting) / rate
        if starting:
            ramp = at <= starting
            times[ramp] = 2.0 * starting / rate * np.sqrt(at[ramp] / starting)
        left = self.ends - self.begins - at
        brake = left < braking
        rest_s = times[self.brakes - self.begins] + 2.0 * braking / rate
        times[brake] = rest_s - 2.0 * braking / rate * np.sqrt(left[brake] / braking)
        return times

    def frame_at(self, elapsed_s: float) -> float:
        """Return which frame it is at, so long after it began."""
        frames = np.arange(self.begins, self.ends + 1)
        return float(np.interp(elapsed_s, self.times_s, frames))

    def time_at(self, frame: float) -> float:
        """Return when it is at a frame; before its first one it is at its steady speed."""
        if frame < self.begins:
            return (frame - self.begins) / self.path.frames_per_s
        return float(np.interp(frame - self.begins, np.arange(len(self.times_s)), self.times_s))

    def trajectory(self, taken_over_at: float | None = None) -> tuple[Floats, Floats]:
        """Return the times and positions to send: from rest, or from where it is taken over."""
        if taken_over_at is None:
            return self.times_s, self.path.positions[self.begins : self.ends + 1]
        from_s = self.time_at(taken_over_at)
        first = int(np.searchsorted(self.times_s, from_s + LEAD_S))
        first = min(first, self.ends - self.begins)
        times = np.maximum(self.times_s[first:] - from_s, LEAD_S)
        return times, self.path.positions[self.begins + first : self.ends + 1]


def windows_of(path: TimedPath, first: int = 0) -> Sequence[PathWindow]:
    """Return the windows from rest at a frame to the end of the path, where none is left."""
    rate = path.frames_per_s
    ramp = max(1, round(RAMP_S / 2 * rate))
    margin = max(1, round(MARGIN_S * rate))
    length = max(margin + 1, round(WINDOW_S * rate))
    windows: list[PathWindow] = []
    begins = first
    while begins < path.last:
        from_rest = not windows
        brakes = begins + length + (ramp if from_rest else 0)
        ends = brakes + ramp
        if path.last - ends <= ramp:  # what would be left is no window of its own
            ends = path.last
            middle = begins + (ends - begins) // 2
            brakes = max(ends - ramp, middle if from_rest else begins)
        windows.append(
            PathWindow(path=path, begins=begins, brakes=brakes, ends=ends, from_rest=from_rest)
        )
        begins = path.last if ends == path.last else brakes - margin
    return windows
