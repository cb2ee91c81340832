"""The servo server on a terminal, in whole sessions of two third-party host libraries.

The bus is paced at 1 Mbps and receives at the speed at which the library opens the terminal.
"""

import signal
import struct
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Protocol

import dynamixel_sdk as sdk
import psutil
import pytest
import rustypot

from drivers.dynamixel.tables.control_table import PULSE_RAD
from sim_twin.servos.__main__ import main
from sim_twin.servos.server import FreeRobotServos
from vla_deploy.robots import load_robot

pytestmark = pytest.mark.stack

BAUD, OTHER_BAUD, OTHER_BAUD_VALUE = 1_000_000, 2_000_000, 4
IDS = (1, 2, 3, 4)
NUMBERS = {1: 1020, 2: 1120, 3: 1060, 4: 1070}
BAUD_RATE, MODE, TEMPERATURE_LIMIT, TORQUE, ERRORS = (8, 1), (11, 1), (31, 1), (64, 1), (70, 1)
P_GAIN, WATCHDOG = (84, 2), (98, 1)
GOAL_PWM, GOAL_CURRENT, GOAL_VELOCITY, GOAL_POSITION = (100, 2), (102, 2), (104, 4), (116, 4)
PWM, CURRENT, VELOCITY, POSITION = (124, 2), (126, 2), (128, 4), (132, 4)
CURRENT_MODE, VELOCITY_MODE, POSITION_MODE, PWM_MODE = 0, 1, 3, 16
ALERT, OVERHEATING = 0x80, 0x04
RANGE_ERROR, LIMIT_ERROR, ACCESS_ERROR = 4, 6, 7

Register = tuple[int, int]


class Host(Protocol):
    """What a session needs of a library; errors are the status packet's byte."""

    def open(self, baud: int) -> None: ...
    def close(self) -> None: ...
    def scan(self) -> dict[int, int]: ...
    def pings(self, servo_id: int) -> bool: ...
    def read(self, servo_id: int, register: Register) -> tuple[int, int]: ...
    def write(self, servo_id: int, register: Register, value: int) -> int: ...
    def read_all(self, register: Register, *, fast: bool) -> list[int]: ...
    def write_all(self, register: Register, values: Sequence[int]) -> None: ...
    def reboot(self, servo_id: int) -> None: ...


def signed(value: int, size: int) -> int:
    return value - (1 << 8 * size) if value >> (8 * size - 1) else value


def to_bytes(value: int, size: int) -> list[int]:
    return list(value.to_bytes(size, "little", signed=value < 0))


class SdkHost:
    def __init__(self, link: Path) -> None:
        self.port = sdk.PortHandler(str(link))
        self.packets = sdk.PacketHandler(2.0)

    def open(self, baud: int) -> None:
        assert self.port.openPort()
        assert self.port.setBaudRate(baud)

    def close(self) -> None:
        self.port.closePort()

    def scan(self) -> dict[int, int]:
        found, _ = self.packets.broadcastPing(self.port)
        return {servo_id: model for servo_id, (model, _) in found.items()}

    def pings(self, servo_id: int) -> bool:
        return bool(self.packets.ping(self.port, servo_id)[1] == sdk.COMM_SUCCESS)

    def read(self, servo_id: int, register: Register) -> tuple[int, int]:
        data, result, error = self.packets.readTxRx(self.port, servo_id, *register)
        assert result == sdk.COMM_SUCCESS
        return int.from_bytes(data, "little"), error

    def write(self, servo_id: int, register: Register, value: int) -> int:
        address, size = register
        result, error = self.packets.writeTxRx(
            self.port, servo_id, address, size, to_bytes(value, size)
        )
        assert result == sdk.COMM_SUCCESS
        return int(error)

    def read_all(self, register: Register, *, fast: bool) -> list[int]:
        group = sdk.GroupSyncRead(self.port, self.packets, *register)
        for servo_id in IDS:
            group.addParam(servo_id)
        assert (group.fastSyncRead() if fast else group.txRxPacket()) == sdk.COMM_SUCCESS
        return [group.getData(servo_id, *register) for servo_id in IDS]

    def write_all(self, register: Register, values: Sequence[int]) -> None:
        group = sdk.GroupSyncWrite(self.port, self.packets, *register)
        for servo_id, value in zip(IDS, values, strict=True):
            group.addParam(servo_id, to_bytes(value, register[1]))
        assert group.txPacket() == sdk.COMM_SUCCESS

    def reboot(self, servo_id: int) -> None:
        assert self.packets.reboot(self.port, servo_id)[0] == sdk.COMM_SUCCESS


class RustypotHost:
    def __init__(self, link: Path) -> None:
        self.link = link

    def open(self, baud: int) -> None:
        self.bus: Any = rustypot.Xl430PyController(str(self.link), baud, 0.2)

    def close(self) -> None:
        self.bus.close()

    def scan(self) -> dict[int, int]:
        return dict(self.bus.broadcast_scan(list(IDS)))

    def pings(self, servo_id: int) -> bool:
        return bool(self.bus.ping(servo_id))

    def read(self, servo_id: int, register: Register) -> tuple[int, int]:
        data, error = self.bus.read_raw_data_with_error(servo_id, *register)
        return int.from_bytes(bytes(data), "little"), error

    def write(self, servo_id: int, register: Register, value: int) -> int:
        address, size = register
        return int(self.bus.write_raw_data_with_error(servo_id, address, to_bytes(value, size)))

    def read_all(self, register: Register, *, fast: bool) -> list[int]:
        self.bus.set_fast_sync_read(fast)
        blocks = self.bus.sync_read_raw_data(list(IDS), *register)
        return [int.from_bytes(bytes(block), "little") for block in blocks]

    def write_all(self, register: Register, values: Sequence[int]) -> None:
        address, size = register
        self.bus.sync_write_raw_data(list(IDS), address, [to_bytes(v, size) for v in values])

    def reboot(self, servo_id: int) -> None:
        assert self.bus.reboot(servo_id)


LIBRARIES: dict[str, Callable[[Path], Host]] = {
    "dynamixel-sdk": SdkHost,
    "rustypot": RustypotHost,
}


def until(reached: Callable[[], bool], timeout_s: float = 10.0) -> None:
    deadline_s = time.monotonic() + timeout_s
    while not reached():
        assert time.monotonic() < deadline_s, "not reached in time"
        time.sleep(0.02)


@contextmanager
def served(path: Path, *words: str) -> Iterator["subprocess.Popen[bytes]"]:
    """Serve a bus until SIGTERM, or until the server ends by itself."""
    command = [sys.executable, "-m", "sim_twin.servos", "--link", str(path), *words]
    with subprocess.Popen(command) as server:
        until(lambda: path.is_symlink() or server.poll() is not None, timeout_s=20.0)
        assert path.is_symlink(), "the server ended before it served"
        yield server
        server.send_signal(signal.SIGTERM)
        assert server.wait(timeout=10) == 0
    assert not path.is_symlink()


@pytest.fixture
def link(tmp_path: Path) -> Iterator[Path]:
    models = ("XM430-W350", "XM540-W270", "XL430-W250", "XC430-W150")
    words = ("--servos", "4", "--models", *models, "--baud", str(BAUD), "--return-delay-us", "20")
    with served(tmp_path / "servos", *words):
        yield tmp_path / "servos"


@pytest.fixture(params=LIBRARIES)
def host(request: pytest.FixtureRequest, link: Path) -> Iterator[Host]:
    host = LIBRARIES[request.param](link)
    host.open(BAUD)
    yield host
    host.close()


def value(host: Host, servo_id: int, register: Register) -> int:
    data, _ = host.read(servo_id, register)
    return signed(data, register[1])


def change_mode(host: Host, servo_id: int, mode: int) -> None:
    assert host.write(servo_id, TORQUE, 0) & ~ALERT == 0
    assert host.write(servo_id, MODE, mode) == 0
    assert host.write(servo_id, TORQUE, 1) == 0


def move_all(host: Host, goals: Sequence[int], *, fast: bool) -> None:
    host.write_all(GOAL_POSITION, goals)

    def arrived() -> bool:
        there = host.read_all(POSITION, fast=fast)
        return all(abs(a - b) <= 5 for a, b in zip(there, goals, strict=True))

    until(arrived)


def test_a_whole_session(host: Host) -> None:
    assert host.scan() == NUMBERS
    assert not host.pings(9)
    assert host.write(1, P_GAIN, 850) == 0
    assert host.read(1, P_GAIN) == (850, 0)
    drive_in_every_mode(host)
    for servo_id in IDS:
        change_mode(host, servo_id, POSITION_MODE)
    move_all(host, [2200, 2300, 2400, 2500], fast=False)
    move_all(host, [1900, 1800, 1700, 1600], fast=True)
    overheat(host, 2)
    bring_back(host, 2)
    move_all(host, [2048] * 4, fast=True)
    trip_the_watchdog(host, 4)


def drive_in_every_mode(host: Host) -> None:
    assert host.write(1, TORQUE, 1) == 0
    assert host.write(1, MODE, VELOCITY_MODE) == ACCESS_ERROR
    change_mode(host, 1, VELOCITY_MODE)
    assert host.write(1, GOAL_VELOCITY, -60) == 0
    until(lambda: abs(value(host, 1, VELOCITY) + 60) <= 2)
    change_mode(host, 1, CURRENT_MODE)
    assert host.write(1, GOAL_CURRENT, 40) == 0
    until(lambda: value(host, 1, VELOCITY) > 20 and value(host, 1, CURRENT) >= 0)
    change_mode(host, 3, PWM_MODE)
    assert host.write(3, GOAL_PWM, 300) == 0
    until(lambda: value(host, 3, VELOCITY) > 40 and value(host, 3, PWM) == 300)


def trip_the_watchdog(host: Host, servo_id: int) -> None:
    assert host.write(servo_id, GOAL_POSITION, 5_000) == LIMIT_ERROR
    assert host.write(servo_id, TORQUE, 5) == RANGE_ERROR
    assert host.write(servo_id, WATCHDOG, 5) == 0
    time.sleep(0.3)  # any packet would feed it
    assert host.read(servo_id, WATCHDOG) == (255, 0)
    assert host.write(servo_id, GOAL_POSITION, 2_000) == RANGE_ERROR
    assert host.write(servo_id, WATCHDOG, 0) == 0
    assert host.write(servo_id, GOAL_POSITION, 2_000) == 0


def overheat(host: Host, servo_id: int) -> None:
    """Lower the limit below room temperature: the servo switches off and raises the alert."""
    assert host.write(servo_id, TORQUE, 0) == 0
    assert host.write(servo_id, TEMPERATURE_LIMIT, 10) == 0
    assert host.write(servo_id, TORQUE, 1) & ~ALERT == 0
    until(lambda: value(host, servo_id, TORQUE) == 0)
    assert host.read(servo_id, ERRORS) == (OVERHEATING, ALERT)
    assert host.write(servo_id, TORQUE, 1) == ALERT
    assert host.read(servo_id, TORQUE) == (0, ALERT)
    assert host.read(1, ERRORS) == (0, 0)


def bring_back(host: Host, servo_id: int) -> None:
    assert host.write(servo_id, TEMPERATURE_LIMIT, 80) == ALERT
    host.reboot(servo_id)
    time.sleep(0.5)
    assert host.read(servo_id, ERRORS) == (0, 0)
    assert host.write(servo_id, TORQUE, 1) == 0


def test_a_servo_is_found_at_the_rate_it_was_set_to(host: Host) -> None:
    assert host.write(4, BAUD_RATE, OTHER_BAUD_VALUE) == 0
    assert not host.pings(4)
    host.close()
    host.open(OTHER_BAUD)
    assert [servo_id for servo_id in (1, 4) if host.pings(servo_id)] == [4]
    assert host.write(4, BAUD_RATE, 3) == 0
    host.close()
    host.open(BAUD)
    assert all(host.pings(servo_id) for servo_id in IDS)


@pytest.mark.parametrize("fast", [False, True])
def test_the_sdk_reads_and_writes_in_bulk(link: Path, fast: bool) -> None:
    host = SdkHost(link)
    host.open(BAUD)
    write = sdk.GroupBulkWrite(host.port, host.packets)
    write.addParam(1, 65, 1, [1])
    write.addParam(3, *GOAL_POSITION, list(struct.pack("<i", 1234)))
    assert write.txPacket() == sdk.COMM_SUCCESS
    read = sdk.GroupBulkRead(host.port, host.packets)
    read.addParam(1, 65, 1)
    read.addParam(3, *GOAL_POSITION)
    assert (read.fastBulkRead() if fast else read.txRxPacket()) == sdk.COMM_SUCCESS
    assert (read.getData(1, 65, 1), read.getData(3, *GOAL_POSITION)) == (1, 1234)
    host.close()


def test_rustypot_names_models_and_registers_on_a_mixed_bus(link: Path) -> None:
    definition = rustypot.Xl430PyController.definition()
    with rustypot.Bus(str(link), BAUD, 0.2, dict.fromkeys(IDS, definition)) as bus:
        assert bus.scan(definition, list(IDS)) == NUMBERS
        assert bus.set_torque(list(IDS), True) == {}
        bus.sync_write_register(list(IDS), "goal_position", [2100, 2150, 2200, 2250])
        until(
            lambda: all(
                abs(there - goal) <= 5
                for there, goal in zip(
                    bus.sync_read_register(list(IDS), "present_position"),
                    (2100, 2150, 2200, 2250),
                    strict=True,
                )
            )
        )


def test_the_server_ends_by_itself_and_sleeps_meanwhile(tmp_path: Path) -> None:
    with served(tmp_path / "servos", "--servos", "16", "--seconds", "1.5") as server:
        before_s = sum(psutil.Process(server.pid).cpu_times()[:2])
        time.sleep(1.0)
        assert sum(psutil.Process(server.pid).cpu_times()[:2]) - before_s < 0.5
        assert server.wait(timeout=10) == 0


def test_a_robots_servos_end_at_the_stops_of_its_joints(tmp_path: Path) -> None:
    robot, path = load_robot("koch_v1_1"), tmp_path / "servos"
    free = FreeRobotServos(robot, horn_off_pulses=10.0)
    low, high = free.rotors.stops_rad[:, robot.joint_index["gripper"]]
    off_rad = robot.servo_bus.servos[5].offset - 10.0 * PULSE_RAD
    assert (low + off_rad, high + off_rad) == pytest.approx((-0.032, 1.6))
    with served(path, "--robot", "koch_v1_1"):
        host = SdkHost(path)
        host.open(robot.servo_bus.baud)
        assert host.packets.ping(host.port, 6)[0] == 1200
        host.close()


def test_a_paced_bus_is_never_faster_than_its_wire(tmp_path: Path) -> None:
    ids, path, times_s = range(1, 17), tmp_path / "servos", []
    words = ("--servos", "16", "--baud", str(BAUD), "--return-delay-us", "100")
    with served(path, *words):
        host = SdkHost(path)
        host.open(BAUD)
        read = sdk.GroupSyncRead(host.port, host.packets, *POSITION)
        for servo_id in ids:
            read.addParam(servo_id)
        for _ in range(20):
            start_s = time.monotonic()
            assert read.txRxPacket() == sdk.COMM_SUCCESS
            times_s.append(time.monotonic() - start_s)
        host.close()
    assert min(times_s) > (30 + 16 * 15) * 10 / BAUD + 16 * 100e-6


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--servos", "300"], "expected 1..252, got 300"),
        (["--robot", "nobody"], "--robot: nobody"),
        (["--return-delay-us", "600"], "--return-delay-us: expected 0..508, got 600"),
        (["--latency-timer-ms", "16"], "--latency-timer-ms: only a paced bus has it; give --baud"),
        (["--baud", "9600", "--jitter-us", "-1"], "--jitter-us: expected 0 or more, got -1.0"),
        (["--baud", "12345"], "(choose from 9600, 57600,"),
    ],
)
def test_arguments_that_no_bus_can_have_are_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], arguments: list[str], said: str
) -> None:
    with pytest.raises(SystemExit) as exit_info:
        main(["--link", str(tmp_path / "servos"), *arguments])
    assert exit_info.value.code == 2
    assert said in capsys.readouterr().err
