"""The servo server on a terminal, in whole sessions of two third-party host libraries.

The bus is paced at 1 Mbps and receives at the speed at which the library opens the terminal.
"""

import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Protocol

import pytest
import rustypot
import scservo_sdk as sdk

from sim_twin.servos.__main__ import main

pytestmark = pytest.mark.stack

BAUD = 1_000_000
NUMBERS = {1: 777, 2: 2825, 3: 777}
MODEL, ID, LOCK, STATUS = (3, 2), (5, 1), (55, 1), (65, 1)
MODE, PROTECTION_TIME, OVERLOAD_TORQUE = (33, 1), (35, 1), (36, 1)
TORQUE, GOAL_POSITION, GOAL_VELOCITY, POSITION = (40, 1), (42, 2), (46, 2), (56, 2)
OVERLOAD = 0x20

Register = tuple[int, int]


class FeetechHost(Protocol):
    """What a session needs of a library; errors are the status packet's byte."""

    def close(self) -> None: ...
    def scan(self) -> dict[int, int]: ...
    def pings(self, servo_id: int) -> bool: ...
    def read(self, servo_id: int, register: Register) -> tuple[int, int]: ...
    def write(self, servo_id: int, register: Register, value: int) -> int: ...
    def read_all(self, ids: Sequence[int], register: Register) -> list[int]: ...
    def write_all(self, ids: Sequence[int], register: Register, values: Sequence[int]) -> None: ...
    def reboot(self, servo_id: int) -> None: ...


def to_bytes(value: int, size: int) -> list[int]:
    return list(value.to_bytes(size, "little"))


class ScservoHost:
    def __init__(self, link: Path) -> None:
        self.port = sdk.PortHandler(str(link))
        self.packets = sdk.PacketHandler(0)
        assert self.port.setBaudRate(BAUD)

    def close(self) -> None:
        self.port.closePort()

    def scan(self) -> dict[int, int]:
        found = {}
        for servo_id in NUMBERS:
            number, result, error = self.packets.ping(self.port, servo_id)
            assert (result, error) == (sdk.COMM_SUCCESS, 0)
            found[servo_id] = number
        return found

    def pings(self, servo_id: int) -> bool:
        return bool(self.packets.ping(self.port, servo_id)[1] == sdk.COMM_SUCCESS)

    def read(self, servo_id: int, register: Register) -> tuple[int, int]:
        data, result, error = self.packets.readTxRx(self.port, servo_id, *register)
        assert result == sdk.COMM_SUCCESS
        return int.from_bytes(bytes(data), "little"), error

    def write(self, servo_id: int, register: Register, value: int) -> int:
        address, size = register
        result, error = self.packets.writeTxRx(
            self.port, servo_id, address, size, to_bytes(value, size)
        )
        assert result == sdk.COMM_SUCCESS
        return int(error)

    def read_all(self, ids: Sequence[int], register: Register) -> list[int]:
        group = sdk.GroupSyncRead(self.port, self.packets, *register)
        for servo_id in ids:
            group.addParam(servo_id)
        assert group.txRxPacket() == sdk.COMM_SUCCESS
        return [group.getData(servo_id, *register) for servo_id in ids]

    def write_all(self, ids: Sequence[int], register: Register, values: Sequence[int]) -> None:
        group = sdk.GroupSyncWrite(self.port, self.packets, *register)
        for servo_id, value in zip(ids, values, strict=True):
            group.addParam(servo_id, to_bytes(value, register[1]))
        assert group.txPacket() == sdk.COMM_SUCCESS

    def reboot(self, servo_id: int) -> None:
        packet = [0xFF, 0xFF, servo_id, 2, 8, 0]  # the library does not know it
        assert self.packets.txPacket(self.port, packet) == sdk.COMM_SUCCESS
        self.port.is_using = False


class Sts3215Host:
    def __init__(self, link: Path) -> None:
        self.bus: Any = rustypot.Sts3215PyController(str(link), BAUD, 0.5)

    def close(self) -> None:
        self.bus.close()

    def scan(self) -> dict[int, int]:
        return dict(self.bus.broadcast_scan(list(NUMBERS)))

    def pings(self, servo_id: int) -> bool:
        return bool(self.bus.ping(servo_id))

    def read(self, servo_id: int, register: Register) -> tuple[int, int]:
        data, error = self.bus.read_raw_data_with_error(servo_id, *register)
        return int.from_bytes(bytes(data), "little"), error

    def write(self, servo_id: int, register: Register, value: int) -> int:
        address, size = register
        return int(self.bus.write_raw_data_with_error(servo_id, address, to_bytes(value, size)))

    def read_all(self, ids: Sequence[int], register: Register) -> list[int]:
        blocks = self.bus.sync_read_raw_data(list(ids), *register)
        return [int.from_bytes(bytes(block), "little") for block in blocks]

    def write_all(self, ids: Sequence[int], register: Register, values: Sequence[int]) -> None:
        address, size = register
        self.bus.sync_write_raw_data(list(ids), address, [to_bytes(v, size) for v in values])

    def reboot(self, servo_id: int) -> None:
        self.bus.reboot(servo_id)


LIBRARIES: dict[str, Callable[[Path], FeetechHost]] = {
    "feetech-servo-sdk": ScservoHost,
    "rustypot": Sts3215Host,
}


def until(reached: Callable[[], bool], timeout_s: float = 20.0) -> None:
    deadline_s = time.monotonic() + timeout_s
    while not reached():
        assert time.monotonic() < deadline_s, "not reached in time"
        time.sleep(0.02)


@contextmanager
def served(path: Path, *words: str) -> Iterator[None]:
    command = [sys.executable, "-m", "sim_twin.servos", "--family", "feetech", "--link", str(path)]
    with subprocess.Popen([*command, *words]) as server:
        until(lambda: path.is_symlink() or server.poll() is not None, timeout_s=60.0)
        assert path.is_symlink(), "the server ended before it served"
        try:
            yield
        finally:
            server.send_signal(signal.SIGTERM)
        assert server.wait(timeout=20) == 0


@pytest.fixture(autouse=True)
def patient_sdk(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let the vendor's library wait as for a slow adapter: it goes by the wall clock."""
    monkeypatch.setattr(sdk.port_handler, "LATENCY_TIMER", 1500)


@pytest.fixture(params=LIBRARIES)
def host(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[FeetechHost]:
    models = ("STS3215-C018", "STS3250")
    words = ("--servos", "3", "--models", *models, "--baud", str(BAUD), "--return-delay-us", "20")
    with served(tmp_path / "servos", *words):
        host = LIBRARIES[request.param](tmp_path / "servos")
        yield host
        host.close()


def test_a_whole_session(host: FeetechHost) -> None:
    ids = list(NUMBERS)
    assert host.scan() == NUMBERS
    assert not host.pings(9)
    assert host.read(2, MODEL) == (2825, 0)
    move_all(host, ids, [2300, 1900, 1024])
    change_id(host, 3, 7)
    move_all(host, [1, 2, 7], [2048, 2048, 2048])
    overload(host, 7)
    move_all(host, [1, 2], [1000, 3000])


def move_all(host: FeetechHost, ids: Sequence[int], goals: Sequence[int]) -> None:
    host.write_all(ids, GOAL_POSITION, goals)
    host.write_all(ids, TORQUE, [1] * len(ids))
    assert host.read_all(ids, GOAL_POSITION) == list(goals)

    def arrived() -> bool:
        there = host.read_all(ids, POSITION)
        return all(abs(a - b) <= 3 for a, b in zip(there, goals, strict=True))

    until(arrived)


def change_id(host: FeetechHost, old: int, new: int) -> None:
    assert host.write(old, LOCK, 0) == 0
    assert host.write(old, ID, new) == 0
    assert host.pings(new)
    assert not host.pings(old)
    assert host.write(new, LOCK, 1) == 0
    host.reboot(new)
    until(lambda: host.pings(new))


def overload(host: FeetechHost, servo_id: int) -> None:
    """Let a speed count as overload: the error comes with every answer until a reboot."""
    assert host.write(servo_id, TORQUE, 0) == 0
    assert host.write(servo_id, MODE, 1) == 0
    assert host.write(servo_id, OVERLOAD_TORQUE, 25) == 0
    assert host.write(servo_id, PROTECTION_TIME, 10) == 0
    assert host.write(servo_id, GOAL_VELOCITY, 2000) == 0
    assert host.write(servo_id, TORQUE, 1) == 0
    until(lambda: host.read(servo_id, STATUS) == (OVERLOAD, OVERLOAD))
    assert host.write(servo_id, TORQUE, 0) == OVERLOAD
    assert host.read(1, STATUS) == (0, 0)
    host.reboot(servo_id)
    until(lambda: host.pings(servo_id))
    assert host.read(servo_id, STATUS) == (0, 0)
    assert host.read(servo_id, MODE) == (0, 0)


def test_rustypot_reads_angles_of_an_unpaced_bus_at_any_speed(tmp_path: Path) -> None:
    with served(tmp_path / "servos", "--servos", "2"):
        bus: Any = rustypot.Sts3215PyController(str(tmp_path / "servos"), 115_200, 0.5)
        assert dict(bus.scan([1, 2, 3])) == {1: 777, 2: 777}
        assert bus.sync_read_present_position([1, 2]) == pytest.approx([0.0, 0.0], abs=0.01)
        bus.sync_write_torque_enable([1, 2], [True, True])
        bus.sync_write_goal_position([1, 2], [0.5, -0.5])
        until(
            lambda: bus.sync_read_present_position([1, 2]) == pytest.approx([0.5, -0.5], abs=0.01)
        )
        bus.close()


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--servos", "300"], r"--servos: expected 1..253, got 300"),
        (["--models", "XM430-W350"], "--models: feetech has SCS0009, STS3215-C001"),
        (["--baud", "57600"], "--baud: feetech has 115200, 128000, 250000, 500000, 1000000"),
    ],
)
def test_arguments_that_no_feetech_bus_can_have_are_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], arguments: list[str], said: str
) -> None:
    with pytest.raises(SystemExit) as exit_info:
        main(["--family", "feetech", "--link", str(tmp_path / "servos"), *arguments])
    assert exit_info.value.code == 2
    assert said in capsys.readouterr().err
