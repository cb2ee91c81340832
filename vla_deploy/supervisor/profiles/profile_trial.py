"""Judge on the running robot whether a profile keeps what it promises."""

from collections.abc import Iterator
from typing import Any, Final

from drivers.clock import Clock
from platforms import Profile
from vla_deploy.ipc import SharedSpace

_MAX_LATE_RATIO: Final = 0.05
_OLD_STATUS_S: Final = 1.0


class ProfileTrial:
    """Compare what control and the processes publish with what they published before the change."""

    def __init__(self, space: SharedSpace, clock: Clock) -> None:
        self._control = space.cell_reader("control_status")
        self._table = space.cell_reader("process_table")
        self._clock = clock
        self._before: dict[str, Any] = {}
        self._allowed_ratio = _MAX_LATE_RATIO

    @property
    def control_state(self) -> str:
        """Return control's state, empty when it is silent."""
        return str(self._status().get("state", ""))

    def begin(self) -> None:
        """Note the ticks so far: a computer that was late before may be as late after."""
        self._before = self._status()
        ticks = max(self._before.get("tick", 1), 1)
        share = self._before.get("late_ticks", 0) / ticks
        self._allowed_ratio = max(_MAX_LATE_RATIO, 2.0 * share)

    def faults(self, profile: Profile) -> tuple[str, ...]:
        """Return what the profile does not keep."""
        return (*self._late(), *self._over_budget(profile))

    def _late(self) -> Iterator[str]:
        now = self._status()
        if not now:
            yield "control is silent"
            return
        ticks = now["tick"] - self._before.get("tick", 0)
        late = now["late_ticks"] - self._before.get("late_ticks", 0)
        if ticks > 0 and late > self._allowed_ratio * ticks:
            allowed = f"{self._allowed_ratio:.0%}"
            yield f"control: {late} of {ticks} ticks late, expected {allowed} at most"

    def _over_budget(self, profile: Profile) -> Iterator[str]:
        sample = self._table.latest()
        rows = sample.document()["processes"] if sample is not None else []
        for row in rows:
            budget, used_mb = profile.budgets.get(row["name"]), row.get("memory_mb")
            if budget is not None and used_mb is not None and used_mb > budget.memory_mb:
                yield f"{row['name']}: {used_mb:.0f} MB, expected {budget.memory_mb:g} MB at most"

    def _status(self) -> dict[str, Any]:
        sample = self._control.latest()
        if sample is None or sample.age_s(self._clock.now_ns()) > _OLD_STATUS_S:
            return {}
        return sample.document()
