"""Show the supervisor, by data, that the twin's loop still goes round."""

from pathlib import Path
from typing import Final

from drivers.clock import NS_PER_S, Clock
from drivers.twin_page import TwinPace
from vla_deploy.ipc import SharedSpace, topics

_PERIOD_NS: Final = NS_PER_S // 2


class TwinStatus:
    """Write the `twin_status` cell where the run has shared memory; a twin alone has none."""

    def __init__(self, run_dir: Path, clock: Clock, pace: TwinPace) -> None:
        self._pace = pace
        folder = run_dir / "ipc"
        self._space = SharedSpace(folder, clock) if folder.is_dir() else None
        self._cell = self._space.cell_writer(topics.TWIN_STATUS) if self._space else None
        self._due_ns = 0

    def publish(
        self, clock_ns: int, simulated_ns: int, real_time_factor: float, held_by: str
    ) -> None:
        """Publish simulated time and pace, twice a second; `held_by` has held time most."""
        if self._cell is None or clock_ns < self._due_ns:
            return
        self._due_ns = clock_ns + _PERIOD_NS
        self._cell.put_document(
            {
                "pace": self._pace.value,
                "simulated_ns": simulated_ns,
                "real_time_factor": real_time_factor,
                "held_by": held_by,
            }
        )

    def close(self) -> None:
        """Unmap the cell."""
        if self._space is not None:
            self._space.close()
