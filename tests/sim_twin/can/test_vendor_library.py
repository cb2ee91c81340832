"""The vendor-neutral `canopen` library controls the emulated drive through the hub process."""

import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from functools import partial

import canopen
import pytest
from canopen.profiles.p402 import BaseNode402

from drivers.canopen import EDS_PATH

pytestmark = pytest.mark.stack

NODE_ID = 5
COUNTS_PER_RAD = 16384 / 6.283185307179586


def eventually(condition: Callable[[], bool], within_s: float = 5.0) -> bool:
    deadline_s = time.monotonic() + within_s
    while time.monotonic() < deadline_s:
        if condition():
            return True
        time.sleep(0.005)
    return condition()


def is_near(drive: BaseNode402, target: int) -> bool:
    return bool(abs(drive.sdo[0x606C].raw - target) < 100)


@pytest.fixture(scope="module")
def network(tmp_path_factory: pytest.TempPathFactory) -> Iterator[canopen.Network]:
    path = tmp_path_factory.mktemp("hub") / "can"
    options = ["--socket", str(path), "--nodes", str(NODE_ID), "--timed", "--bitrate", "500000"]
    command = [sys.executable, "-m", "sim_twin.can", *options]
    with subprocess.Popen(command) as hub:
        try:
            assert eventually(path.is_socket, within_s=20.0)
            network = canopen.Network()
            network.NOTIFIER_CYCLE = 0.05
            network.connect(interface="vla_hub", channel=str(path))
            yield network
            network.disconnect()
        finally:
            hub.terminate()


@pytest.fixture
def node(network: canopen.Network) -> Iterator[BaseNode402]:
    """Return a drive that has just booted."""
    node = network.add_node(BaseNode402(NODE_ID, str(EDS_PATH)))
    node.nmt.state = "RESET"
    assert eventually(lambda: node.nmt.state == "PRE-OPERATIONAL")
    yield node
    network.sync.stop()
    del network[NODE_ID]


@pytest.fixture
def drive(network: canopen.Network, node: BaseNode402) -> BaseNode402:
    node.setup_402_state_machine()
    node.nmt.state = "OPERATIONAL"
    network.sync.start(0.005)
    return node


def test_it_reads_and_writes_objects_and_long_texts(node: BaseNode402) -> None:
    assert node.sdo[0x1000].raw & 0xFFFF == 402
    assert node.sdo[0x1008].raw == "vla_deploy wheel drive"
    assert node.sdo[0x1018][2].raw == 0x57484C31
    node.sdo[0x6083].raw = 12345
    assert node.sdo[0x6083].raw == 12345
    label = "left wheel, behind the battery, fuse 3"
    node.sdo[0x2000].raw = label
    assert node.sdo[0x2000].raw == label


REFUSED = [
    (0x6041, 0, b"\0\0", 0x06010002),
    (0x2100, 0, b"\0", 0x06020000),
    (0x1018, 9, b"\0", 0x06090011),
    (0x6083, 0, b"\0\0", 0x06070010),
    (0x6060, 0, b"\x01", 0x06090030),
    (0x6007, 0, b"\x07\0", 0x06090030),
]


def test_it_is_refused_with_the_standards_codes(node: BaseNode402) -> None:
    for index, subindex, data, code in REFUSED:
        with pytest.raises(canopen.SdoAbortedError) as refusal:
            node.sdo.download(index, subindex, data)
        assert refusal.value.code == code, hex(index)


def test_it_sees_boot_up_and_heartbeat(node: BaseNode402) -> None:
    node.nmt.state = "RESET"
    assert eventually(lambda: node.nmt.state == "PRE-OPERATIONAL")
    node.sdo[0x1017].raw = 20
    node.nmt.state = "OPERATIONAL"
    assert eventually(lambda: node.nmt.wait_for_heartbeat(timeout=2.0) == "OPERATIONAL")


def test_it_reads_the_pdo_layout_that_the_driver_expects(drive: BaseNode402) -> None:
    assert [variable.index for variable in drive.rpdo[1]] == [0x6040, 0x60FF]
    assert [variable.index for variable in drive.tpdo[1]] == [0x6041, 0x606C]
    assert [variable.index for variable in drive.tpdo[2]] == [0x6064, 0x6077]


def test_it_enables_turns_stops_and_enables_again(drive: BaseNode402) -> None:
    drive.state = "OPERATION ENABLED"
    target = round(4.0 * COUNTS_PER_RAD)
    drive.rpdo[1]["Target velocity"].raw = target
    drive.rpdo[1].transmit()
    assert eventually(lambda: abs(drive.sdo[0x606C].raw - target) < 100)
    assert drive.sdo[0x6041].raw & 1 << 10

    drive.state = "QUICK STOP ACTIVE"
    assert eventually(lambda: drive.state == "SWITCH ON DISABLED")
    assert abs(drive.sdo[0x606C].raw) <= drive.sdo[0x606F].raw

    drive.state = "OPERATION ENABLED"
    assert drive.state == "OPERATION ENABLED"
    drive.state = "SWITCH ON DISABLED"


def test_it_gets_the_emergency_of_its_own_lost_heartbeat_and_resets_the_fault(
    network: canopen.Network, drive: BaseNode402
) -> None:
    drive.sdo[0x1016][1].raw = 0x7F << 16 | 60
    drive.state = "OPERATION ENABLED"
    network.send_message(0x77F, b"\x05")
    assert eventually(lambda: drive.state == "FAULT")
    assert [emergency.code for emergency in drive.emcy.active] == [0x8130]
    assert drive.sdo[0x603F].raw == 0x8130
    assert drive.sdo[0x1003][1].raw == 0x8130

    drive.reset_from_fault()
    assert drive.state == "OPERATION ENABLED"
    assert eventually(lambda: not drive.emcy.active)


def test_it_maps_other_process_data_and_gets_them(
    network: canopen.Network, node: BaseNode402
) -> None:
    node.tpdo.read()
    pdo = node.tpdo[2]
    pdo.clear()
    pdo.add_variable("DC link circuit voltage")
    pdo.add_variable("Motor temperature")
    pdo.enabled = True
    pdo.save()
    node.nmt.state = "OPERATIONAL"
    network.sync.start(0.005)
    assert eventually(lambda: pdo["DC link circuit voltage"].raw == 24_000)
    assert pdo["Motor temperature"].raw == 25


def test_it_follows_cyclic_velocities_and_shows_the_mode(drive: BaseNode402) -> None:
    drive.sdo[0x6060].raw = 9
    assert drive.sdo[0x6061].raw == 9
    drive.state = "OPERATION ENABLED"
    for velocity_rad_s in (0.5, 1.0, 1.5):
        target = round(velocity_rad_s * COUNTS_PER_RAD)
        drive.rpdo[1]["Target velocity"].raw = target
        drive.rpdo[1].transmit()
        assert eventually(partial(is_near, drive, target))


def test_it_reboots_a_drive_into_its_defaults(drive: BaseNode402) -> None:
    drive.sdo[0x6083].raw = 4321
    drive.state = "OPERATION ENABLED"
    drive.nmt.state = "RESET"
    assert eventually(lambda: drive.nmt.state == "PRE-OPERATIONAL")
    assert drive.sdo[0x6083].raw == 52152
    assert drive.sdo[0x6041].raw & 0x4F == 0x40
