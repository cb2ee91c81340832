from collections.abc import Iterator

import can
import pytest

from drivers.wheel_drives.bus import PowerState
from sim_twin.can import CanWire, MemoryBus, WheelDrive

INVALID = 1 << 31
STATUSWORD, POSITION, TEMPERATURE = 0x60410010, 0x60640020, 0x20010010
SIZES = {0x1400: 4, 0x1800: 4, 0x1600: 4, 0x1A00: 4}


class Master:
    """Configure one drive by SDO."""

    def __init__(self) -> None:
        self.drive = WheelDrive(1)
        self.bus = MemoryBus(CanWire([self.drive]))
        self.bus.recv()

    def send(self, can_id: int, data: bytes = b"") -> list[can.Message]:
        self.bus.send(can.Message(arbitration_id=can_id, is_extended_id=False, data=data))
        return list(iter(self.bus.recv, None))

    def write(self, index: int, subindex: int, value: int, size: int) -> int:
        """Return the abort code, 0 where the drive has taken the value."""
        head = bytes((0x23 | (4 - size) << 2,)) + index.to_bytes(2, "little") + bytes((subindex,))
        (reply,) = self.send(0x601, head + value.to_bytes(size, "little").ljust(4, b"\0"))
        return int.from_bytes(reply.data[4:], "little") if reply.data[0] == 0x80 else 0

    def remap(self, mapping: int, *entries: int) -> None:
        communication = mapping - 0x200
        cob_id = (0x180 if mapping == 0x1A00 else 0x200) + 1
        steps = [(communication, 1, cob_id | INVALID, 4), (mapping, 0, 0, 1)]
        steps += [(mapping, row, entry, 4) for row, entry in enumerate(entries, start=1)]
        steps += [(mapping, 0, len(entries), 1), (communication, 1, cob_id, 4)]
        assert [self.write(*step) for step in steps] == [0] * len(steps)

    def power_state(self) -> PowerState:
        return self.drive.power_state

    def sync(self) -> dict[int, bytes]:
        return {frame.arbitration_id: bytes(frame.data) for frame in self.send(0x080)}


@pytest.fixture
def master() -> Iterator[Master]:
    master = Master()
    yield master
    master.bus.shutdown()


def test_another_mapping_is_honoured(master: Master) -> None:
    master.remap(0x1A00, STATUSWORD, TEMPERATURE)
    master.send(0x000, b"\x01\x01")
    assert master.sync()[0x181][2:] == (25).to_bytes(2, "little")


def test_a_setpoint_follows_its_mapping(master: Master) -> None:
    master.remap(0x1600, 0x60400010)
    master.send(0x000, b"\x01\x01")
    master.send(0x201, b"\x06\x00")
    assert master.power_state() is PowerState.READY_TO_SWITCH_ON


def test_a_mapping_changes_only_in_the_standards_order(master: Master) -> None:
    assert master.write(0x1A00, 0, 0, 1) == 0x08000022
    assert master.write(0x1A00, 1, POSITION, 4) == 0x08000022
    assert master.write(0x1800, 1, INVALID | 0x181, 4) == 0
    assert master.write(0x1A00, 1, POSITION, 4) == 0x06010000
    assert master.write(0x1A00, 0, 0, 1) == 0
    assert master.write(0x1A00, 1, POSITION, 4) == 0


@pytest.mark.parametrize(
    ("entries", "code"),
    [
        ([0x60FE0010], 0x06020000),
        ([0x60830020], 0x06040041),
        ([0x60410020], 0x06040041),
        ([POSITION, POSITION, STATUSWORD], 0x06040042),
    ],
    ids=["no such object", "not mappable", "wrong length", "too long"],
)
def test_a_mapping_that_cannot_be_is_refused(master: Master, entries: list[int], code: int) -> None:
    master.write(0x1800, 1, INVALID | 0x181, 4)
    master.write(0x1A00, 0, 0, 1)
    for row, entry in enumerate(entries, start=1):
        assert master.write(0x1A00, row, entry, 4) == 0
    assert master.write(0x1A00, 0, len(entries), 1) == code


def test_a_readonly_object_is_no_setpoint(master: Master) -> None:
    master.write(0x1400, 1, INVALID | 0x201, 4)
    master.write(0x1600, 0, 0, 1)
    master.write(0x1600, 1, STATUSWORD, 4)
    assert master.write(0x1600, 0, 1, 1) == 0x06040041


def test_an_invalid_pdo_is_silent_and_another_identifier_is_used(master: Master) -> None:
    assert master.write(0x1800, 1, 0x190, 4) == 0x06090030
    assert master.write(0x1800, 1, INVALID | 0x181, 4) == 0
    master.send(0x000, b"\x01\x01")
    assert set(master.sync()) == {0x281}
    assert master.write(0x1800, 1, 0x190, 4) == 0
    assert set(master.sync()) == {0x190, 0x281}


def test_a_transmission_type_divides_the_syncs(master: Master) -> None:
    assert master.write(0x1800, 2, 3, 1) == 0
    master.send(0x000, b"\x01\x01")
    assert [0x181 in master.sync() for _ in range(6)] == [False, False, True] * 2
    assert master.write(0x1800, 2, 255, 1) == 0x06090030


def test_a_synchronous_setpoint_waits_for_sync(master: Master) -> None:
    assert master.write(0x1400, 2, 1, 1) == 0
    master.send(0x000, b"\x01\x01")
    master.send(0x201, b"\x06\0\0\0\0\0")
    assert master.power_state() is PowerState.SWITCH_ON_DISABLED
    master.sync()
    assert master.power_state() is PowerState.READY_TO_SWITCH_ON


def test_a_reset_brings_the_old_mapping_back(master: Master) -> None:
    master.remap(0x1A00, STATUSWORD)
    master.send(0x000, b"\x82\x01")
    master.send(0x000, b"\x01\x01")
    assert len(master.sync()[0x181]) == 6


def test_another_node_id_moves_every_identifier(master: Master) -> None:
    master.drive.set_node_id(7)
    assert [frame.arbitration_id for frame in iter(master.bus.recv, None)] == [0x707]
    master.send(0x000, b"\x01\x07")
    assert set(master.sync()) == {0x187, 0x287}


def test_a_segmented_download_must_alternate_its_toggle_and_keep_its_size(master: Master) -> None:
    start = bytes.fromhex("21002000") + (9).to_bytes(4, "little")
    assert master.send(0x601, start)[0].data[0] == 0x60
    assert master.send(0x601, b"\x00wheel l")[0].data[0] == 0x20
    abort = master.send(0x601, b"\x00eftwron")[0].data
    assert int.from_bytes(abort[4:], "little") == 0x05030000
    master.send(0x601, start)
    master.send(0x601, b"\x00wheel l")
    abort = master.send(0x601, b"\x19eft\0\0\0\0")[0].data  # three bytes make ten
    assert int.from_bytes(abort[4:], "little") == 0x06070010


def test_a_segment_without_a_transfer_and_a_huge_transfer_are_refused(master: Master) -> None:
    for segment in (0x01, 0x60):  # of a download, of an upload
        abort = master.send(0x601, bytes((segment,)) + bytes(7))[0].data
        assert int.from_bytes(abort[4:], "little") == 0x05040001
    abort = master.send(0x601, bytes.fromhex("21002000ffff0000"))[0].data
    assert int.from_bytes(abort[4:], "little") == 0x05040005
