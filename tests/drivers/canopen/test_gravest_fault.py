"""Keep the gravest complaint of a drive, however many come after it."""

from collections.abc import Iterator

import pytest

from drivers.canopen import DriveSpec, WheelDriveBus
from drivers.canopen.drive_port import DrivePort
from drivers.canopen.objects import EMERGENCY_WIRE
from drivers.errors import DeviceFault
from drivers.wheel_drives.bus import ResetRule
from sim_twin.can import MemoryBus, WheelDrive
from sim_twin.can.free_wheel import FreeWheel, FreeWheelWorld

SHORT_CIRCUIT, OVER_TEMPERATURE, HEARTBEAT_LOST, CLEARED = 0x2340, 0x4310, 0x8130, 0
TICK_NS = 4_000_000


@pytest.fixture
def port() -> DrivePort:
    return DrivePort(DriveSpec(node_id=1, joint="left"), 100_000_000)


def tell(port: DrivePort, code: int, register: int = 0x01) -> None:
    port.on_emergency(EMERGENCY_WIRE.pack(code, register, bytes(5)), 0)


@pytest.mark.parametrize(
    ("codes", "kept"),
    [
        ((SHORT_CIRCUIT, HEARTBEAT_LOST), SHORT_CIRCUIT),
        ((HEARTBEAT_LOST, SHORT_CIRCUIT), SHORT_CIRCUIT),
        ((SHORT_CIRCUIT, OVER_TEMPERATURE, HEARTBEAT_LOST), SHORT_CIRCUIT),
        ((OVER_TEMPERATURE, HEARTBEAT_LOST), OVER_TEMPERATURE),
        ((OVER_TEMPERATURE, 0x3210), 0x3210),
    ],
)
def test_the_gravest_fault_is_kept_and_the_newest_of_equals(
    port: DrivePort, codes: tuple[int, ...], kept: int
) -> None:
    for code in codes:
        tell(port, code)
    assert port.fault is not None
    assert port.fault.code == kept


def test_an_error_that_goes_while_others_last_takes_nothing_back(port: DrivePort) -> None:
    tell(port, SHORT_CIRCUIT)
    tell(port, CLEARED, register=0x03)
    assert port.reset_rule is ResetRule.NEVER
    tell(port, CLEARED, register=0x00)
    assert port.fault is None


def test_a_storm_of_emergencies_leaves_the_gravest(port: DrivePort) -> None:
    tell(port, SHORT_CIRCUIT)
    for _ in range(10_000):
        tell(port, HEARTBEAT_LOST)
    assert port.fault is not None
    assert port.fault.code == SHORT_CIRCUIT


@pytest.fixture
def world() -> FreeWheelWorld[WheelDrive]:
    return FreeWheelWorld([FreeWheel(WheelDrive(1))])


@pytest.fixture
def bus(world: FreeWheelWorld[WheelDrive]) -> Iterator[WheelDriveBus]:
    bus = WheelDriveBus(MemoryBus(world.wire), world, [DriveSpec(node_id=1, joint="left")])
    bus.connect()
    yield bus
    bus.close()


def test_a_short_circuit_stays_one_when_the_heartbeat_is_lost_after_it(
    bus: WheelDriveBus, world: FreeWheelWorld[WheelDrive]
) -> None:
    drive = world.wheels[0].drive
    drive.raise_fault(SHORT_CIRCUIT)
    drive.raise_fault(HEARTBEAT_LOST)
    for _ in range(5):
        bus.cycle(None)
        world.sleep_until(world.now_ns() + TICK_NS)
    (refusal,) = bus.reset_fault()
    assert "0x2340" in refusal
    for _ in range(200):
        state = bus.cycle(None)
        world.sleep_until(world.now_ns() + TICK_NS)
    assert state.faulted == (True,)


def test_a_new_host_finds_the_short_circuit_in_the_error_field(
    world: FreeWheelWorld[WheelDrive],
) -> None:
    drive = world.wheels[0].drive
    drive.raise_fault(SHORT_CIRCUIT)
    drive.raise_fault(HEARTBEAT_LOST)
    host = WheelDriveBus(MemoryBus(world.wire), world, [DriveSpec(node_id=1, joint="left")])
    with pytest.raises(DeviceFault, match="0x2340"):
        host.connect()
    host.close()


def test_a_drive_that_refuses_its_error_field_is_judged_by_its_latest_code(
    world: FreeWheelWorld[WheelDrive],
) -> None:
    drive = world.wheels[0].drive
    drive.raise_fault(HEARTBEAT_LOST)
    for row in range(5):
        del drive._objects._variables[0x1003, row]
    host = WheelDriveBus(MemoryBus(world.wire), world, [DriveSpec(node_id=1, joint="left")])
    host.connect()
    host.close()
