import contextlib
import sys
import time
from collections.abc import Callable
from pathlib import Path

import psutil
import pytest

from vla_deploy.supervisor.runs.options import RunOptions
from vla_deploy.supervisor.supervisor import Supervisor
from vla_deploy.supervisor.systemd import NotifyTarget
from vla_deploy.supervisor.table import ProcessSpec, RestartPolicy

CHILD = str(Path(__file__).with_name("child.py"))
QUICK = RestartPolicy(initial_s=0.05, cap_s=0.1, max_restarts=3)


class Stage:
    """Build supervisors over tiny children, and read what the children have told."""

    def __init__(self, directory: Path) -> None:
        self.base = directory / "base"
        self.events_path = directory / "events"

    def row(self, name: str, behaviour: str = "run", **changes: object) -> ProcessSpec:
        changes = {"restart": QUICK, "stop_timeout_s": 5.0, **changes}
        return ProcessSpec(
            name=name,
            command=(CHILD, "{run_dir}", name, str(self.events_path), behaviour),
            ready_files=(f"ready/{name}",),
            **changes,
        )

    def supervisor(
        self, *table: ProcessSpec, notify: NotifyTarget | None = None, **options: object
    ) -> Supervisor:
        return Supervisor(RunOptions(runtime_base=self.base, **options), table, notify=notify)

    @property
    def state_dir(self) -> Path:
        return self.base.with_name("base-state")

    def events(self) -> list[str]:
        return [line.rpartition(" ")[0] for line in self._lines()]

    def pids(self, name: str) -> list[int]:
        return [
            int(line.split()[-1]) for line in self._lines() if line.startswith(f"{name} started")
        ]

    def leftovers(self) -> list[str]:
        left = {path.name for path in self.base.iterdir()} - {"lock"}
        shared = Path("/dev/shm").glob("*vla-deploy-*")
        return [*left, *(path.name for path in shared if self._is_ours(path))]

    def _is_ours(self, shared: Path) -> bool:
        owner = shared / "owner.json"
        return not owner.is_file() or str(self.base) in owner.read_text()

    def _lines(self) -> list[str]:
        return self.events_path.read_text().splitlines() if self.events_path.exists() else []


@pytest.fixture
def stage(tmp_path: Path):
    stage = Stage(tmp_path)
    yield stage
    for name in ("a", "b", "c", "grandchild"):
        for pid in stage.pids(name):
            with contextlib.suppress(psutil.NoSuchProcess):  # a zombie is none either
                process = psutil.Process(pid)
                if CHILD in " ".join(process.cmdline()):
                    process.kill()


@pytest.fixture
def eventually() -> Callable[[Callable[[], bool]], bool]:
    def wait(condition: Callable[[], bool], timeout_s: float = 10.0) -> bool:
        until_ns = time.monotonic_ns() + round(timeout_s * 1e9)
        while not condition():
            if time.monotonic_ns() > until_ns:
                return False
            time.sleep(0.02)
        return True

    return wait


@pytest.fixture
def python() -> str:
    return sys.executable


@pytest.fixture
def step_until(eventually) -> Callable[[Supervisor, Callable[[], bool]], bool]:
    def wait(supervisor: Supervisor, condition: Callable[[], bool]) -> bool:
        def look() -> bool:
            supervisor.step()
            return condition()

        return eventually(look)

    return wait


@pytest.fixture
def rows() -> Callable[[Supervisor], dict[str, dict]]:
    def read(supervisor: Supervisor) -> dict[str, dict]:
        document = supervisor.space.cell_reader("process_table").latest().document()
        return {row["name"]: row for row in document["processes"]}

    return read


@pytest.fixture
def is_running() -> Callable[[int], bool]:
    def look(pid: int) -> bool:
        try:
            return psutil.Process(pid).status() != psutil.STATUS_ZOMBIE
        except psutil.NoSuchProcess:
            return False

    return look
