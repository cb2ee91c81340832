"""Send a long path to control window by window, and follow how the joints keep to it."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from drivers.clock import NS_PER_S, Clock
from vla_deploy.client.motions import Ended, Floats, Motions
from vla_deploy.client.path_windows import PathWindow, TimedPath, windows_of

DONE: Final = "done"


@dataclass(frozen=True, slots=True, kw_only=True)
class PlayedPath:
    """Say how playing ended, at which frame, and how far the joints were off at most.

    `setpoint_error` is that of control's setpoints, `position_error` that of the joints; in rad or
    m. `pauses` counts takeovers that came too late, so that the joints rested in between.
    """

    ended: Ended
    frame: float
    setpoint_error: float
    position_error: float
    pauses: int


class PathPlayer:
    """Play a path from its first frame, where the joints have to be at rest.

    Where the setpoints are further from the path than `tolerance`, as after late ticks of control,
    nothing takes over: the window goes on to its end, and the next one begins there, from rest.
    """

    def __init__(self, motions: Motions, clock: Clock, path: TimedPath, tolerance: Floats) -> None:
        """Take what the path's joints may be off, in rad or m each."""
        self._motions = motions
        self._clock = clock
        self._path = path
        self._tolerance = tolerance
        self._windows: Sequence[PathWindow] = windows_of(path)
        self._current = 0
        self._motion_id = 0
        self._began_ns = 0
        self._setpoint_error = 0.0
        self._position_error = 0.0
        self._pauses = 0

    def play(self, wait: Callable[[], None]) -> PlayedPath:
        """Play it to the end; `wait` waits a moment, and may raise to end it.

        Raises:
            BadPayload: a window is longer than control takes.
        """
        if not self._windows:
            return self._result(Ended(status=DONE, reason=""), self._path.last)
        self._send(self._windows[0])
        while True:
            wait()
            self._motions.step()
            frame = self._frame()
            ended = self._motions.ended(self._motion_id)
            is_near = self._is_near(frame)
            if ended is None:
                if is_near:
                    self._take_over(frame)
            elif ended.status != DONE or self._window.ends == self._path.last:
                return self._result(ended, self._window.ends if ended.status == DONE else frame)
            else:
                self._go_on_from_rest()

    @property
    def _window(self) -> PathWindow:
        return self._windows[self._current]

    def _frame(self) -> float:
        return self._window.frame_at((self._clock.now_ns() - self._began_ns) / NS_PER_S)

    def _take_over(self, frame: float) -> None:
        """Send the next window where its time has come, and the present one is at full speed."""
        if self._current + 1 == len(self._windows) or frame >= self._window.brakes:
            return
        following = self._windows[self._current + 1]
        if frame >= following.begins:
            last = self._motion_id
            self._current += 1
            self._send(following, frame)
            self._motions.forget(last)

    def _go_on_from_rest(self) -> None:
        self._pauses += 1
        self._windows = windows_of(self._path, self._window.ends)
        self._current = 0
        self._send(self._windows[0])

    def _send(self, window: PathWindow, taken_over_at: float | None = None) -> None:
        times_s, positions = window.trajectory(taken_over_at)
        passed_s = 0.0 if taken_over_at is None else window.time_at(taken_over_at)
        self._began_ns = self._clock.now_ns() - round(passed_s * NS_PER_S)
        self._motion_id = self._motions.follow(self._path.joints, times_s, positions)

    def _is_near(self, frame: float) -> bool:
        """Measure how far the joints are off, and return whether their setpoints are near."""
        view = self._motions.look(self._path.joints)
        if view is None:
            return False
        expected = self._path.at(frame)
        setpoint_errors = np.abs(view.setpoint - expected)
        self._setpoint_error = max(self._setpoint_error, float(setpoint_errors.max()))
        position_error = float(np.abs(view.position - expected).max())
        self._position_error = max(self._position_error, position_error)
        return bool((setpoint_errors <= self._tolerance).all())

    def _result(self, ended: Ended, frame: float) -> PlayedPath:
        return PlayedPath(
            ended=ended,
            frame=frame,
            setpoint_error=self._setpoint_error,
            position_error=self._position_error,
            pauses=self._pauses,
        )
