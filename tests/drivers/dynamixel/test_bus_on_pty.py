"""The same bus on a real pseudo-terminal served by another process, which is then killed."""

import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from drivers.clock import NS_PER_S, MonotonicClock
from drivers.dynamixel import DynamixelBus, ServoSpec, WatchdogState
from drivers.errors import LinkLost
from drivers.serial_port import SerialPort

pytestmark = pytest.mark.stack
CLOCK = MonotonicClock()
SPECS = [ServoSpec(id=n, model_name="XM430-W350", joint=f"joint_{n}") for n in range(1, 9)]


@pytest.fixture
def server(tmp_path: Path) -> Iterator[tuple[Path, subprocess.Popen[bytes]]]:
    link = tmp_path / "servos"
    command = [sys.executable, "-m", "sim_twin.servos", "--link", str(link), "--servos", "8"]
    with subprocess.Popen(command) as process:
        deadline_ns = CLOCK.now_ns() + 20 * NS_PER_S
        while not link.exists():
            assert process.poll() is None
            assert CLOCK.now_ns() < deadline_ns
            CLOCK.sleep_until(CLOCK.now_ns() + NS_PER_S // 100)
        yield link, process
        process.send_signal(signal.SIGKILL)


def open_bus(link: Path) -> DynamixelBus:
    return DynamixelBus(
        SerialPort(link, 1_000_000, CLOCK), CLOCK, SPECS, baud=1_000_000, reply_margin_s=0.2
    )


def test_joints_move_over_the_wire_and_a_killed_server_is_a_lost_link(
    server: tuple[Path, subprocess.Popen[bytes]],
) -> None:
    link, process = server
    bus = open_bus(link)
    bus.connect()
    bus.read_state()
    bus.enable_torque()
    goal = bus.state.position_rad + 0.3
    deadline_ns = CLOCK.now_ns() + 10 * NS_PER_S
    while np.abs(bus.state.position_rad - goal).max() > 0.02:
        assert CLOCK.now_ns() < deadline_ns
        bus.read_state()
        bus.write_goals(goal)
        CLOCK.sleep_until(CLOCK.now_ns() + NS_PER_S // 250)
    assert bus.watchdog is WatchdogState.ARMED
    process.send_signal(signal.SIGKILL)
    process.wait()
    start_ns = CLOCK.now_ns()
    with pytest.raises(LinkLost, match="reconnect"):
        while True:
            bus.read_state()
    assert CLOCK.now_ns() - start_ns < NS_PER_S
    bus.close()
