"""Provide a clock, a run, and a robot in the twin with a flight recorder, in lock-step."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest

from drivers.clock import NS_PER_S
from sim_twin.harness.lockstep_stack import LockstepControl
from vla_deploy.runtime.node import NodeContext
from vla_deploy.telemetry.folder import FlightFolder
from vla_deploy.telemetry.node import RecorderNode
from vla_deploy.telemetry.recorded_file import RecordedFile, read_flight

WALL_NS = 1_800_000_000_000_000_000


class StepClock:
    """Stand still until a test moves it; `each` runs after every wait."""

    def __init__(self) -> None:
        self.time_ns = 100 * NS_PER_S
        self.each: Callable[[], None] = lambda: None

    def now_ns(self) -> int:
        return self.time_ns

    def wall_ns(self) -> int:
        return WALL_NS + self.time_ns

    def sleep_until(self, deadline_ns: int) -> None:
        self.time_ns = max(self.time_ns, deadline_ns)
        self.each()


class Rig(LockstepControl):
    """Add the recorder, and what the supervisor and the executor would write."""

    def __init__(self, tmp_path: Path) -> None:
        super().__init__(tmp_path)
        self.folder = FlightFolder(tmp_path / "flights")
        self.events = self.space.ring_reader("flight_event", from_start=True)
        self.requests = self.space.ring_writer("flight_request")
        self.process_table = self.space.cell_writer("process_table")
        self._sees = False
        self.arm()
        self.settle()
        self.recorder = self.new_recorder()
        self.run(0.1)  # what was so before its first look would call for no flight

    def settle(self) -> None:
        """Wait until the robot has been armed without any cause for a second."""
        clear_ns = self.lockstep.clock.now_ns()
        for _ in range(100):
            self.run(0.1)
            now_ns, status = self.lockstep.clock.now_ns(), self.status()
            if status["state"] != "armed" or status["cause"]:
                clear_ns = now_ns
            if now_ns - clear_ns >= 1_000_000_000:
                return
        raise AssertionError(f"the robot does not settle: {self.status()}")

    def new_recorder(self) -> RecorderNode:
        step = self.lockstep
        recorder = RecorderNode(step.context, self.folder, lambda: WALL_NS + step.clock.now_ns())
        step.add(recorder)
        return recorder

    def run(self, seconds: float) -> None:
        self.lockstep.run_for(seconds)

    def drive(self, seconds: float) -> None:
        if not self._sees:
            self._sees = True
            self.add_senses()
        self.drive_for(seconds, 0.2, 0.1)

    def flights(self) -> list[RecordedFile]:
        return [read_flight(path) for path in self.folder.files()]

    def wait_for_flight(self) -> RecordedFile:
        before = len(self.folder.files())
        assert self.lockstep.run_until(lambda: len(self.folder.files()) > before, 60.0)
        return self.flights()[-1]


@dataclass(frozen=True, slots=True, kw_only=True)
class Stopped:
    """Hold the flight of a drive that an operator stopped at `stopped_ns`."""

    flight: RecordedFile
    stopped_ns: int
    now_ns: int
    ticks_before: int


@pytest.fixture
def clock() -> StepClock:
    return StepClock()


@pytest.fixture
def context(tmp_path: Path, clock: StepClock) -> NodeContext:
    """Return the context of a run whose topics the test writes."""
    run_dir = tmp_path / "base" / "run"
    (run_dir / "logs").mkdir(parents=True)
    return NodeContext(
        run_dir=run_dir, robot="butler", profile="desktop", devices_dir=None, clock=clock
    )


@pytest.fixture
def rig(tmp_path: Path) -> Iterator[Rig]:
    rig = Rig(tmp_path)
    yield rig
    rig.close()


@pytest.fixture(scope="module")
def stopped(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Stopped]:
    """Drive for four seconds and stop; the tests that only read share the flight."""
    rig = Rig(tmp_path_factory.mktemp("stopped"))
    ticks_before = rig.status()["tick"]
    rig.drive(4.0)
    stopped_ns = rig.lockstep.clock.now_ns()
    rig.operate("estop")
    flight, now_ns = rig.wait_for_flight(), rig.lockstep.clock.now_ns()
    yield Stopped(flight=flight, stopped_ns=stopped_ns, now_ns=now_ns, ticks_before=ticks_before)
    rig.close()
