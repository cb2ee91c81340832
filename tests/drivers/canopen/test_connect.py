"""Connect to drives that are not as they should be."""

import pytest

from drivers.canopen import DriveSpec, WheelDriveBus
from drivers.canopen.objects import HEARTBEAT_CONSUMER, HEARTBEAT_PRODUCER, IDENTITY
from drivers.errors import NoReply, WrongDevice
from sim_twin.can import MemoryBus, MotorMounting, WheelDrive
from sim_twin.can.free_wheel import FreeWheel, FreeWheelWorld


def world(*drives: WheelDrive) -> FreeWheelWorld[WheelDrive]:
    return FreeWheelWorld([FreeWheel(drive) for drive in drives])


def driver(world: FreeWheelWorld[WheelDrive], *specs: DriveSpec) -> WheelDriveBus:
    return WheelDriveBus(MemoryBus(world.wire), world, specs, heartbeat_s=0.2)


LEFT = DriveSpec(node_id=1, joint="left_wheel")
RIGHT = DriveSpec(node_id=2, joint="right_wheel")


def test_a_silent_drive_is_named_with_a_remedy_after_a_bounded_wait() -> None:
    one = world(WheelDrive(1))
    bus = driver(one, LEFT, RIGHT)
    before_ns = one.now_ns()
    with pytest.raises(NoReply, match=r"right_wheel \(node 2\); check power"):
        bus.connect()
    assert one.now_ns() - before_ns <= 3_100_000_000
    bus.close()


def test_a_drive_that_dies_while_it_is_configured_is_named() -> None:
    one = world(WheelDrive(1))
    bus = driver(one, LEFT)
    drive = one.wheels[0].drive
    drive._objects.on_write[HEARTBEAT_PRODUCER, 0] = lambda value: drive.set_supply(on=False)
    with pytest.raises(NoReply, match=r"drive left_wheel \(node 1\): writing"):
        bus.connect()
    bus.close()


def test_another_product_is_the_wrong_device() -> None:
    one = world(WheelDrive(1))
    one.wheels[0].drive._objects.live[IDENTITY, 2] = lambda: 0x1234
    bus = driver(one, LEFT)
    with pytest.raises(WrongDevice, match="product 0x1018:2 is 0x1234, expected 0x57484C31"):
        bus.connect()
    bus.close()


def test_another_encoder_is_the_wrong_device() -> None:
    one = world(WheelDrive(1, MotorMounting(counts_per_rev=4096)))
    bus = driver(one, LEFT)
    with pytest.raises(WrongDevice, match="encoder increments 0x608F:1 is 0x1000, expected 0x4000"):
        bus.connect()
    bus.close()


def test_another_pdo_layout_is_the_wrong_device() -> None:
    one = world(WheelDrive(1))
    one.wheels[0].drive._objects.live[0x1A01, 2] = lambda: 0x60780010
    bus = driver(one, LEFT)
    with pytest.raises(WrongDevice, match="PDO mapping 0x1A01:2 is 0x60780010"):
        bus.connect()
    bus.close()


def test_a_refused_parameter_names_object_and_value() -> None:
    one = world(WheelDrive(1))
    bus = driver(one, DriveSpec(node_id=1, joint="left_wheel", acceleration_rad_s2=1e-5))
    with pytest.raises(WrongDevice, match=r"node 1: 0x6083:0 .* takes 1..2147483647, not 0"):
        bus.connect()
    bus.close()


def test_heartbeats_are_configured_both_ways() -> None:
    one = world(WheelDrive(1))
    bus = driver(one, LEFT)
    bus.connect()
    objects = one.wheels[0].drive._objects
    assert objects.get(HEARTBEAT_PRODUCER) == 50
    assert objects.get(HEARTBEAT_CONSUMER, 1) == 0x7F << 16 | 200
    bus.close()


def test_two_drives_with_one_node_id_are_refused() -> None:
    with pytest.raises(ValueError, match="share a node id"):
        driver(world(WheelDrive(1)), LEFT, LEFT)
