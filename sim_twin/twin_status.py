"""Tell the supervisor, by data, that the twin's loop still goes round."""

from pathlib import Path
from typing import Final

from drivers.clock import NS_PER_S, Clock
from vla_deploy.ipc import SharedSpace

_PERIOD_NS: Final = NS_PER_S // 2


class TwinStatus:
    """Write the `twin_status` cell where the run has shared memory; a twin alone has none."""

    def __init__(self, run_dir: Path, clock: Clock) -> None:
        folder = run_dir / "ipc"
        self._space = SharedSpace(folder, clock) if folder.is_dir() else None
        self._cell = self._space.cell_writer("twin_status") if self._space else None
        self._due_ns = 0

    def tell(self, wall_ns: int, simulated_ns: int, real_time_factor: float) -> None:
        """Publish simulated time and pace, twice a second."""
        if self._cell is None or wall_ns < self._due_ns:
            return
        self._due_ns = wall_ns + _PERIOD_NS
        document = {"simulated_ns": simulated_ns, "real_time_factor": real_time_factor}
        self._cell.put_document(document)

    def close(self) -> None:
        """Unmap the cell."""
        if self._space is not None:
            self._space.close()
