"""The vendor's own host library judges the emulated servos, over a real terminal."""

import os
import signal
import struct
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from dynamixel_sdk import (
    COMM_SUCCESS,
    GroupBulkRead,
    GroupSyncRead,
    GroupSyncWrite,
    PacketHandler,
    PortHandler,
)

from sim_twin.servos.__main__ import main

pytestmark = pytest.mark.stack

TORQUE, LED, GOAL, POSITION, P_GAIN, MODE = 64, 65, 116, 132, 84, 11
IDS = range(1, 17)
ACCESS_ERROR = 7
RANGE_ERROR = 4
LIMIT_ERROR = 6


def start_server(link: Path, *extra: str) -> subprocess.Popen[bytes]:
    server = subprocess.Popen(
        [sys.executable, "-m", "sim_twin.servos", "--link", str(link), "--servos", "16", *extra]
    )
    until(lambda: link.is_symlink() or server.poll() is not None, timeout_s=20.0)
    assert link.is_symlink(), "the server ended before it served"
    return server


def until(reached: Callable[[], bool], timeout_s: float = 10.0) -> None:
    deadline = time.monotonic() + timeout_s
    while not reached():
        assert time.monotonic() < deadline, "not reached in time"
        time.sleep(0.02)


@pytest.fixture(scope="module")
def link(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    path = tmp_path_factory.mktemp("bus") / "servos"
    server = start_server(path, "--models", "XM430-W350", "XM540-W270", "XL430-W250", "XC430-W150")
    yield path
    server.send_signal(signal.SIGTERM)
    assert server.wait(timeout=10) == 0
    assert not path.is_symlink()


@pytest.fixture
def port(link: Path) -> Iterator[Any]:
    port = PortHandler(str(link))
    assert port.openPort()
    assert port.setBaudRate(1_000_000)
    yield port
    port.closePort()


@pytest.fixture
def host(port: Any) -> Iterator[Any]:
    host = PacketHandler(2.0)
    yield host
    for servo_id in IDS:
        assert host.write1ByteTxRx(port, servo_id, TORQUE, 0)[0] == COMM_SUCCESS


def test_ping_and_broadcast_ping_find_every_servo(port: Any, host: Any) -> None:
    assert host.ping(port, 3) == (1060, COMM_SUCCESS, 0)
    found, result = host.broadcastPing(port)
    assert result == COMM_SUCCESS
    assert {servo_id: model for servo_id, (model, _) in found.items()} == {
        servo_id: (1070, 1020, 1120, 1060)[servo_id % 4] for servo_id in IDS
    }


def test_registers_of_all_sizes_are_written_and_read(port: Any, host: Any) -> None:
    assert host.write1ByteTxRx(port, 1, LED, 1) == (COMM_SUCCESS, 0)
    assert host.write2ByteTxRx(port, 1, P_GAIN, 850) == (COMM_SUCCESS, 0)
    assert host.write4ByteTxRx(port, 1, GOAL, 1_000) == (COMM_SUCCESS, 0)
    assert host.read1ByteTxRx(port, 1, LED) == (1, COMM_SUCCESS, 0)
    assert host.read2ByteTxRx(port, 1, P_GAIN) == (850, COMM_SUCCESS, 0)
    assert host.read4ByteTxRx(port, 1, GOAL) == (1_000, COMM_SUCCESS, 0)


def test_refusals_carry_the_vendors_error_numbers(port: Any, host: Any) -> None:
    assert host.write1ByteTxRx(port, 2, TORQUE, 5) == (COMM_SUCCESS, RANGE_ERROR)
    assert host.write4ByteTxRx(port, 2, GOAL, 5_000) == (COMM_SUCCESS, LIMIT_ERROR)
    assert host.write1ByteTxRx(port, 2, TORQUE, 1) == (COMM_SUCCESS, 0)
    assert host.write1ByteTxRx(port, 2, MODE, 1) == (COMM_SUCCESS, ACCESS_ERROR)


@pytest.mark.parametrize("fast", [False, True])
def test_a_group_moves_and_is_read_back(port: Any, host: Any, fast: bool) -> None:
    goals = {servo_id: 2_000 + 10 * servo_id + (100 if fast else 0) for servo_id in IDS}
    write = GroupSyncWrite(port, host, GOAL, 4)
    read = GroupSyncRead(port, host, POSITION, 4)
    for servo_id in IDS:
        assert host.write1ByteTxRx(port, servo_id, TORQUE, 1) == (COMM_SUCCESS, 0)
        assert write.addParam(servo_id, list(struct.pack("<i", goals[servo_id])))
        assert read.addParam(servo_id)
    assert write.txPacket() == COMM_SUCCESS

    def all_arrived() -> bool:
        assert (read.fastSyncRead() if fast else read.txRxPacket()) == COMM_SUCCESS
        errors = [read.getData(servo_id, POSITION, 4) - goals[servo_id] for servo_id in IDS]
        return all(abs(error) <= 3 for error in errors)

    until(all_arrived)


def test_bulk_read_takes_different_registers(port: Any, host: Any) -> None:
    bulk = GroupBulkRead(port, host)
    bulk.addParam(1, 0, 2)
    bulk.addParam(2, 144, 2)
    assert bulk.txRxPacket() == COMM_SUCCESS
    assert (bulk.getData(1, 0, 2), bulk.getData(2, 144, 2)) == (1020, 120)


def test_reboot_brings_a_servo_back_without_torque(port: Any, host: Any) -> None:
    assert host.write1ByteTxRx(port, 4, TORQUE, 1) == (COMM_SUCCESS, 0)
    assert host.reboot(port, 4) == (COMM_SUCCESS, 0)
    until(lambda: host.read1ByteTxRx(port, 4, TORQUE) == (0, COMM_SUCCESS, 0))


def test_an_armed_watchdog_trips_and_is_cleared_by_zero(port: Any, host: Any) -> None:
    assert host.write1ByteTxRx(port, 5, 98, 50) == (COMM_SUCCESS, 0)
    assert host.write1ByteTxRx(port, 5, TORQUE, 1) == (COMM_SUCCESS, 0)
    time.sleep(1.2)  # any packet would feed it
    assert host.read1ByteTxRx(port, 5, 98) == (255, COMM_SUCCESS, 0)
    assert host.write4ByteTxRx(port, 5, GOAL, 2_000) == (COMM_SUCCESS, RANGE_ERROR)
    assert host.write1ByteTxRx(port, 5, 98, 0) == (COMM_SUCCESS, 0)
    assert host.write4ByteTxRx(port, 5, GOAL, 2_000) == (COMM_SUCCESS, 0)


def test_the_server_ends_by_itself_and_sleeps_meanwhile(tmp_path: Path) -> None:
    server = start_server(tmp_path / "servos", "--seconds", "1.5")
    before = cpu_s(server.pid)
    time.sleep(1.0)
    assert cpu_s(server.pid) - before < 0.5
    assert server.wait(timeout=10) == 0
    assert not (tmp_path / "servos").is_symlink()


def cpu_s(pid: int) -> float:
    fields = Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def test_a_paced_bus_is_never_faster_than_its_wire(tmp_path: Path) -> None:
    baud, wire_bytes = 1_000_000, 30 + 16 * 15
    server = start_server(tmp_path / "servos", "--baud", str(baud), "--return-delay-us", "100")
    port = PortHandler(str(tmp_path / "servos"))
    assert port.openPort()
    assert port.setBaudRate(baud)
    read = GroupSyncRead(port, PacketHandler(2.0), POSITION, 4)
    for servo_id in IDS:
        read.addParam(servo_id)
    times_s = []
    for _ in range(20):
        start_s = time.monotonic()
        assert read.txRxPacket() == COMM_SUCCESS
        times_s.append(time.monotonic() - start_s)
    assert min(times_s) > wire_bytes * 10 / baud + 16 * 100e-6
    port.closePort()
    server.send_signal(signal.SIGTERM)
    assert server.wait(timeout=10) == 0


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--servos", "300"], "expected 1..252, got 300"),
        (["--return-delay-us", "600"], "--return-delay-us: expected 0..508, got 600"),
        (["--latency-timer-ms", "16"], "--latency-timer-ms: only a paced bus has it; give --baud"),
        (["--baud", "9600", "--jitter-us", "-1"], "--jitter-us: expected 0 or more, got -1.0"),
        (["--baud", "12345"], "invalid choice: 12345"),
    ],
)
def test_arguments_that_no_bus_can_have_are_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], arguments: list[str], said: str
) -> None:
    with pytest.raises(SystemExit) as exit_info:
        main(["--link", str(tmp_path / "servos"), *arguments])
    assert exit_info.value.code == 2
    assert said in capsys.readouterr().err
