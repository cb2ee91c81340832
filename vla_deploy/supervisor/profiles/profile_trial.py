"""Judge on the running robot whether a profile keeps what it promises."""

from collections.abc import Iterator
from typing import Final

from drivers.clock import Clock
from platforms import Profile
from vla_deploy.ipc import SharedSpace, topics
from vla_deploy.ipc.payloads.motion import ControlStatus

_MAX_LATE_RATIO: Final = 0.05
_OLD_STATUS_S: Final = 1.0


class ProfileTrial:
    """Compare what control and the processes publish with what they published before the change."""

    def __init__(self, space: SharedSpace, clock: Clock) -> None:
        self._control = space.cell_reader(topics.CONTROL_STATUS)
        self._table = space.cell_reader(topics.PROCESS_TABLE)
        self._clock = clock
        self._before: ControlStatus | None = None
        self._allowed_ratio = _MAX_LATE_RATIO

    @property
    def control_state(self) -> str:
        """Return control's state, empty when it is silent."""
        status = self._status()
        return "" if status is None else status["state"]

    def begin(self) -> None:
        """Note the ticks so far: a computer that was late before may be as late after."""
        self._before = self._status()
        tick, late_ticks = _counts(self._before)
        self._allowed_ratio = max(_MAX_LATE_RATIO, 2.0 * late_ticks / max(tick, 1))

    def faults(self, profile: Profile) -> tuple[str, ...]:
        """Return what the profile does not keep."""
        return (*self._late(), *self._over_budget(profile))

    def _late(self) -> Iterator[str]:
        now = self._status()
        if now is None:
            yield "control is silent"
            return
        tick, late_ticks = _counts(self._before)
        ticks, late = now["tick"] - tick, now["late_ticks"] - late_ticks
        if ticks > 0 and late > self._allowed_ratio * ticks:
            allowed = f"{self._allowed_ratio:.0%}"
            yield f"control: {late} of {ticks} ticks late, expected {allowed} at most"

    def _over_budget(self, profile: Profile) -> Iterator[str]:
        sample = self._table.latest()
        rows = sample.document()["processes"] if sample is not None else []
        for row in rows:
            budget, used_mb = profile.budgets.get(row["name"]), row["memory_mb"]
            if budget is not None and used_mb is not None and used_mb > budget.memory_mb:
                yield f"{row['name']}: {used_mb:.0f} MB, expected {budget.memory_mb:g} MB at most"

    def _status(self) -> ControlStatus | None:
        sample = self._control.latest()
        if sample is None or sample.age_s(self._clock.now_ns()) > _OLD_STATUS_S:
            return None
        return sample.document()


def _counts(status: ControlStatus | None) -> tuple[int, int]:
    """Return the ticks so far, and how many of them were late."""
    return (0, 0) if status is None else (status["tick"], status["late_ticks"])
