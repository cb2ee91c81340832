"""Pace simulated time to the wall clock, and let it slip rather than catch up in a burst."""

LAG_CAP_NS = 20_000_000


class Pacer:
    """Say when the next physics step is due.

    A machine that falls behind may catch up `lag_cap_ns` of steps; whatever is older is dropped, so
    that simulated time slips and the buses are served between any two steps. It rests after a step
    for as long as that took, a period at most: the twin runs before all others, and a slow computer
    would have nothing left for the robot. `worst_lag_ns` is the furthest behind since somebody set
    it to 0.
    """

    def __init__(self, step_ns: int, start_ns: int, lag_cap_ns: int = LAG_CAP_NS) -> None:
        self.slipped_ns = 0
        self.worst_lag_ns = 0
        self._step_ns = step_ns
        self._lag_cap_ns = lag_cap_ns
        self._due_ns = start_ns
        self._rested_ns = start_ns

    def due(self, wall_ns: int) -> bool:
        """Return whether a step is due at `wall_ns`; drop the lag beyond the cap."""
        lag_ns = wall_ns - self._due_ns
        self.worst_lag_ns = max(self.worst_lag_ns, lag_ns)
        excess_ns = lag_ns - self._lag_cap_ns
        if excess_ns > 0:
            self.slipped_ns += excess_ns
            self._due_ns += excess_ns
        return wall_ns >= max(self._due_ns, self._rested_ns)

    def stepped(self) -> None:
        """Note that one step was made."""
        self._due_ns += self._step_ns

    def rest(self, begun_ns: int, wall_ns: int) -> None:
        """Rest from `wall_ns` on, when all is done that the step begun at `begun_ns` brought."""
        self._rested_ns = wall_ns + min(self._step_ns, wall_ns - begun_ns)

    def wait_ns(self, wall_ns: int) -> int:
        """Return how long from `wall_ns` to the next step, at least 0."""
        return max(0, max(self._due_ns, self._rested_ns) - wall_ns)

    def since_step_ns(self, wall_ns: int) -> int:
        """Return how much of a step has passed since the last one, at most a whole one."""
        return min(self._step_ns, max(0, wall_ns - self._due_ns + self._step_ns))


class RealTimeFactor:
    """Measure simulated over wall time in windows of about a second."""

    def __init__(self, wall_ns: int, now_ns: int, window_ns: int = 1_000_000_000) -> None:
        self.value = 1.0
        self._window_ns = window_ns
        self._wall_ns = wall_ns
        self._now_ns = now_ns

    def update(self, wall_ns: int, now_ns: int) -> None:
        """Renew `value` when a window is complete."""
        elapsed_ns = wall_ns - self._wall_ns
        if elapsed_ns >= self._window_ns:
            self.value = (now_ns - self._now_ns) / elapsed_ns
            self._wall_ns, self._now_ns = wall_ns, now_ns
