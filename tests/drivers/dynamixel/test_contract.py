"""The Dynamixel driver keeps the servo bus contract in memory and behind a terminal."""

import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from drivers.base import ByteTransport
from drivers.clock import NS_PER_S, Clock, MonotonicClock
from drivers.dynamixel import DynamixelBus, ServoSpec
from drivers.errors import LinkLost
from drivers.serial_port import SerialPort
from sim_twin.contracts.bench import HardwareBench, WireBench
from sim_twin.contracts.servo_bus import (
    ServoBusContract,
    ServoTorqueContract,
    ServoUnplugContract,
)
from sim_twin.servos.server import FreeServos, make_specs

MODELS = ["XM430-W350", "XL430-W250", "XL330-M288"]
COUNT = 6
BAUD = 1_000_000


class FreeServoDevice:
    """Turn the shafts of a bank as a line's device."""

    def __init__(self, servos: FreeServos) -> None:
        self._servos = servos
        self.receive, self.transmit = servos.bank.receive, servos.bank.transmit

    def step(self, now_ns: int) -> None:
        self._servos.advance_to(now_ns)


def specs(models: list[str]) -> list[ServoSpec]:
    return [
        ServoSpec(id=n + 1, model_name=models[n % len(models)], joint=f"joint_{n + 1}")
        for n in range(COUNT)
    ]


def connected(line: ByteTransport, clock: Clock, models: list[str]) -> DynamixelBus:
    bus = DynamixelBus(line, clock, specs(models), baud=BAUD, reply_margin_s=0.1)
    bus.connect()
    return bus


class TestInMemory(ServoBusContract, ServoTorqueContract, ServoUnplugContract):
    @pytest.fixture
    def bench(self) -> WireBench[DynamixelBus]:
        servos = FreeServos(make_specs(COUNT, MODELS), supply_v=5.0)
        return WireBench(
            FreeServoDevice(servos), lambda line, clock: connected(line, clock, MODELS)
        )


@contextmanager
def served(path: Path) -> Iterator["subprocess.Popen[bytes]"]:
    """Serve servos on a pseudo-terminal, from another process."""
    command = [sys.executable, "-m", "sim_twin.servos", "--link", str(path)]
    with subprocess.Popen([*command, "--servos", str(COUNT)]) as server:
        clock = MonotonicClock()
        while not path.is_symlink():
            assert server.poll() is None
            clock.sleep_until(clock.now_ns() + 10_000_000)
        yield server
        server.kill()


def terminal_bench(path: Path) -> HardwareBench[DynamixelBus]:
    return HardwareBench(lambda clock: connected(SerialPort(path, BAUD, clock), clock, MODELS[:1]))


@pytest.fixture(scope="module")
def terminal(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    path = tmp_path_factory.mktemp("bus") / "servos"
    with served(path):
        yield path


class TestBehindATerminal(ServoBusContract, ServoTorqueContract):
    @pytest.fixture
    def bench(self, terminal: Path) -> HardwareBench[DynamixelBus]:
        return terminal_bench(terminal)


def test_a_killed_server_is_a_lost_link_at_once(tmp_path: Path) -> None:
    with served(tmp_path / "servos") as server:
        bench = terminal_bench(tmp_path / "servos")
        bus = bench.open()
        bus.read_state()
        server.kill()
        server.wait()
        start_ns = bench.clock.now_ns()
        with pytest.raises(LinkLost, match="reconnect"):
            while True:
                bus.read_state()
        assert bench.clock.now_ns() - start_ns < NS_PER_S
        bus.close()
