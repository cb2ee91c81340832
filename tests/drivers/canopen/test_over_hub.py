"""Run the driver against drives in another process, on the real clock."""

import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from drivers.can.interface import open_can_bus
from drivers.canopen import DriveSpec, WheelDriveBus
from drivers.clock import MonotonicClock
from drivers.errors import LinkLost
from drivers.wheel_drives.bus import DriveState

pytestmark = pytest.mark.stack

TICK_NS = 4_000_000
CLOCK = MonotonicClock()


@pytest.fixture
def hub(tmp_path: Path) -> Iterator[subprocess.Popen[bytes]]:
    path = tmp_path / "can"
    command = [sys.executable, "-m", "sim_twin.can", "--socket", str(path), "--nodes", "1", "2"]
    with subprocess.Popen(command) as process:
        deadline_s = time.monotonic() + 20.0
        while not path.is_socket() and time.monotonic() < deadline_s:
            time.sleep(0.01)
        yield process
        process.kill()


@pytest.fixture
def bus(hub: subprocess.Popen[bytes], tmp_path: Path) -> Iterator[WheelDriveBus]:
    specs = [DriveSpec(node_id=1, joint="left"), DriveSpec(node_id=2, joint="right", sign=-1)]
    bus = WheelDriveBus(open_can_bus(str(tmp_path / "can")), CLOCK, specs, heartbeat_s=0.5)
    bus.connect()
    yield bus
    bus.close()


def run(bus: WheelDriveBus, duration_s: float, velocity_rad_s: float) -> DriveState:
    deadline_ns = CLOCK.now_ns()
    for _ in range(round(duration_s * 1e9) // TICK_NS):
        state = bus.cycle(np.full(2, velocity_rad_s))
        deadline_ns += TICK_NS
        CLOCK.sleep_until(deadline_ns)
    return state


def test_the_wheels_turn_across_processes_and_a_killed_hub_is_a_lost_link(
    bus: WheelDriveBus, hub: subprocess.Popen[bytes]
) -> None:
    bus.enable()
    state = run(bus, 0.8, 3.0)
    assert state.enabled
    assert state.velocity_rad_s == pytest.approx([3.0, 3.0], abs=0.1)
    assert np.all(state.position_rad > 0.5)
    hub.kill()
    hub.wait()
    with pytest.raises(LinkLost, match="CAN hub"):
        run(bus, 0.1, 0.0)
