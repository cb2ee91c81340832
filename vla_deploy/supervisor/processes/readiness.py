"""Judge by its data and its files whether a process is ready."""

from collections.abc import Mapping
from pathlib import Path

from drivers.clock import Clock
from vla_deploy.ipc import BY_NAME, CellReader, SharedSpace
from vla_deploy.supervisor.table import ProcessSpec


class Readiness:
    """Look at the topic and the files that one process of the table promises."""

    def __init__(self, spec: ProcessSpec, run_dir: Path, space: SharedSpace, clock: Clock) -> None:
        self._files = tuple(run_dir / name for name in spec.ready_files)
        self._clock = clock
        self._deadline_s = BY_NAME[spec.ready_topic].deadline_s if spec.ready_topic else 0.0
        self._reader = _reader(space, spec.ready_topic)

    def forget(self) -> None:
        """Remove what an earlier instance has left, before the next one starts."""
        for path in self._files:
            path.unlink(missing_ok=True)

    def is_ready(self, pid: int) -> bool:
        """Return whether the instance `pid` has done all it promises."""
        return all(path.exists() for path in self._files) and self.is_fresh(pid)

    def is_fresh(self, pid: int) -> bool:
        """Return whether its topic, if it has one, is young and written by `pid`."""
        if self._reader is None:
            return True
        sample = self._reader.latest()
        if sample is None or sample.writer_pid != pid:
            return False
        return sample.age_s(self._clock.now_ns()) <= self._deadline_s


def _reader(space: SharedSpace, topic: str | None) -> CellReader | None:
    return space.cell_reader(topic) if topic else None


def readiness_of(
    table: tuple[ProcessSpec, ...], run_dir: Path, space: SharedSpace, clock: Clock
) -> Mapping[str, Readiness]:
    """Return the judge of each process."""
    return {spec.name: Readiness(spec, run_dir, space, clock) for spec in table}
