"""The server paces its bus, sleeps in between, ends by itself and refuses impossible options."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest
from dynamixel_sdk import COMM_SUCCESS, GroupSyncRead, PacketHandler, PortHandler

from sim_twin.servos.__main__ import main

pytestmark = pytest.mark.stack

POSITION = 132
IDS = range(1, 17)


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
