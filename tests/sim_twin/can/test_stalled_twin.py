"""Stall the twin's loop on an injected clock: waiting frames are received, and no drive faults."""

import gc
from collections.abc import Iterator
from pathlib import Path

import can
import pytest

from drivers.can.interface import open_can_bus
from drivers.canopen.cia402 import FAULT_STATES
from drivers.canopen.objects import HEARTBEAT_COB
from drivers.canopen.spec import HOST_NODE_ID
from platforms import load_profile
from sim_twin import process
from sim_twin.can import WheelDrive
from sim_twin.physics.engine import STEP_NS
from sim_twin.priority import Priority
from sim_twin.process import TwinOptions, TwinProcess
from vla_deploy.control.output.base_drive import can_wheels
from vla_deploy.robots import load_robot

TICK_NS = 4_000_000


class Clock:
    """The wall clock of both processes, moved only by the test."""

    def __init__(self) -> None:
        self.wall_ns = 1_000_000_000

    def now_ns(self) -> int:
        return self.wall_ns

    def sleep_until(self, deadline_ns: int) -> None:
        raise AssertionError("nobody sleeps here")


class Bench:
    """Run the twin's loop and the robot's wheels in turn."""

    def __init__(self, run_dir: Path) -> None:
        self.clock = Clock()
        self.channel = str(run_dir / "dev" / load_robot("butler").can_bus.device)
        options = TwinOptions(robot="butler", world="flat", seed=0, run_dir=run_dir, camera=False)
        self.twin = TwinProcess(options, self.clock)
        self.wheels = can_wheels(load_robot("butler"), load_profile("desktop"), self, self.clock)  # type: ignore[arg-type]

    def can(self, name: str) -> can.BusABC:
        return open_can_bus(self.channel)

    @property
    def drives(self) -> list[WheelDrive]:
        return [drive for drive in self.twin._twin.drives if isinstance(drive, WheelDrive)]

    def run_twin(self, rounds: int) -> None:
        """Run rounds of the twin's loop without advancing time."""
        left = iter(range(rounds))
        self.twin.run(lambda: next(left, None) is None)

    def tick(self, *, twin_runs: bool = True) -> None:
        """Advance time by 4 ms, with a tick of control and, unless it is stalled, of the twin."""
        self.clock.wall_ns += TICK_NS
        if twin_runs:
            self.run_twin(TICK_NS // STEP_NS + 1)
        self.wheels.cycle(0.2, 0.0)

    def connect(self) -> None:
        for _ in self.wheels._connecting():
            self.clock.wall_ns += TICK_NS
            self.run_twin(TICK_NS // STEP_NS + 1)
        self.wheels.enable()
        for _ in range(60):
            self.tick()
        assert self.wheels.enabled


@pytest.fixture
def bench(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Bench]:
    monkeypatch.setattr(process, "claim_priority", lambda: Priority.ORDINARY)
    bench = Bench(tmp_path)
    bench.connect()
    yield bench
    bench.wheels.close()
    bench.twin.close()
    gc.unfreeze()


@pytest.mark.parametrize("stall_ticks", [5, 20])
def test_a_stalled_loop_lets_no_drive_miss_its_host(bench: Bench, stall_ticks: int) -> None:
    for _ in range(stall_ticks):
        bench.tick(twin_runs=False)
    for _ in range(100):
        bench.tick()
    assert [drive.power_state in FAULT_STATES for drive in bench.drives] == [False, False]
    assert all(drive._objects.get(0x1003, 0) == 0 for drive in bench.drives)
    assert bench.wheels.lost == 0


def test_frames_that_wait_are_heard_before_time_goes_on(bench: Bench) -> None:
    heard_ns: list[int] = []
    drive = bench.drives[0]
    drive._consumer.hear = heard_ns.append  # type: ignore[method-assign]
    other = open_can_bus(bench.channel)
    bench.run_twin(1)
    beat = can.Message(
        arbitration_id=HEARTBEAT_COB + HOST_NODE_ID, is_extended_id=False, data=b"\x05"
    )
    before_ns = bench.twin._twin.now_ns
    bench.clock.wall_ns += 3 * STEP_NS
    other.send(beat)
    bench.run_twin(2)
    assert bench.twin._twin.now_ns == before_ns + STEP_NS
    assert heard_ns == [before_ns - STEP_NS]
    other.shutdown()
