"""Throw random frames at every CAN parser: none may crash, hang or accept a wrong frame."""

import random
import struct
from typing import Any

import can
import pytest

from drivers.can.errors import describe
from drivers.can.slcan import parse_line
from drivers.can.words import describe_canopen, describe_odrive
from drivers.canopen import DriveSpec
from drivers.canopen.drive_port import DrivePort
from drivers.canopen.objects import TPDO1, TPDO2
from drivers.canopen.sdo import SdoClient
from drivers.errors import DriverError, ProtocolError
from drivers.odrive import AxisSpec
from drivers.odrive.axis_port import AxisPort
from drivers.odrive.codec import MESSAGES, AxisState, OdriveCommand, decode, encode
from sim_twin.contracts.scripted import ManualClock

NORMAL = 5_000
LONG = 1_000_000
CASES = [
    pytest.param(NORMAL),
    pytest.param(LONG, marks=[pytest.mark.slow, pytest.mark.timeout(900)]),
]
SIZES = (0, 1, 2, 3, 4, 5, 6, 7, 8, 8, 8, 8)


def payload(source: random.Random) -> bytes:
    return source.randbytes(source.choice(SIZES))


@pytest.mark.parametrize("count", CASES)
def test_canopen_frames_are_taken_only_at_their_length(count: int) -> None:
    source = random.Random(1)
    port = DrivePort(DriveSpec(node_id=1, joint="wheel"), 100_000_000)
    port.rated_torque_nm = 4.0
    takers: list[tuple[Any, int]] = [
        (port.on_status, TPDO1.wire.size),
        (port.on_position, TPDO2.wire.size),
        (port.on_heartbeat, 1),
        (port.on_emergency, 8),
    ]
    for _ in range(count):
        take, size = source.choice(takers)
        data = payload(source)
        try:
            take(data, 0)
        except ProtocolError:
            assert len(data) != size
        else:
            assert len(data) == size
    assert abs(port.position_rad) < float("inf")


@pytest.mark.parametrize("count", CASES)
def test_odrive_frames_are_taken_only_as_their_signals(count: int) -> None:
    source = random.Random(2)
    port = AxisPort(AxisSpec(node_id=1, joint="wheel"), 100_000_000)
    states = {int(state) for state in AxisState}
    for _ in range(count):
        command, data = source.randrange(32), payload(source)
        before = (port.heartbeats, port.position_rad, port.velocity_rad_s)
        try:
            port.take(command, data, 0)
        except ProtocolError:
            assert (port.heartbeats, port.position_rad, port.velocity_rad_s) == before
            continue
        if command == OdriveCommand.HEARTBEAT:
            assert len(data) >= 7
            assert data[4] in states
        if command == OdriveCommand.GET_ENCODER_ESTIMATES:
            assert len(data) == 8
        assert abs(port.position_rad) < float("inf")
        assert abs(port.velocity_rad_s) < float("inf")


@pytest.mark.parametrize("count", CASES)
def test_odrive_messages_survive_their_own_packing(count: int) -> None:
    source = random.Random(3)
    for _ in range(count):
        command = source.choice(list(MESSAGES))
        data = source.randbytes(MESSAGES[command].wire.size)
        values = decode(command, data)
        again = encode(command, *values)
        padding = {OdriveCommand.RX_SDO, OdriveCommand.TX_SDO, OdriveCommand.HEARTBEAT}
        if command in padding or any(value != value for value in values):
            assert struct.calcsize(MESSAGES[command].wire.format) == len(again)
        else:
            assert again == data


@pytest.mark.parametrize("count", CASES)
def test_an_sdo_transfer_ends_whatever_is_replied(count: int) -> None:
    source = random.Random(4)
    clock = ManualClock()
    replies = 0
    while replies < count:
        client = SdoClient(lambda can_id, data: None, 1, "node 1", clock)
        transfer: Any = (
            client.upload(0x1000, 0)
            if source.random() < 0.5
            else client.download(0x1000, 0, source.randbytes(source.randrange(40)))
        )
        try:
            while True:
                next(transfer)
                clock.ns += 20_000_000
                data = bytearray(payload(source))
                if len(data) == 8 and source.random() < 0.7:
                    data[1:4] = b"\x00\x10\x00"
                replies += 1
                try:
                    client.take_reply(bytes(data), clock.ns)
                except ProtocolError:
                    assert len(data) != 8
        except (StopIteration, DriverError):
            continue


@pytest.mark.parametrize("count", CASES)
def test_any_frame_is_put_into_words(count: int) -> None:
    source = random.Random(5)
    for _ in range(count):
        kind = source.randrange(8)
        data = payload(source)
        frame = can.Message(
            arbitration_id=source.randrange(0x800),
            is_extended_id=kind == 0,
            is_remote_frame=kind == 1,
            is_error_frame=kind == 2,
            dlc=len(data),
            data=None if kind == 1 else data,
        )
        for words in (describe_canopen(frame), describe_odrive(frame)):
            assert words.kind
        assert describe(frame)


@pytest.mark.parametrize("count", CASES)
def test_a_serial_adapters_text_is_a_whole_frame_or_refused(count: int) -> None:
    source = random.Random(6)
    alphabet = "tTrRzZ0123456789ABCDEFabcdef\n xS\ufffd"
    for _ in range(count):
        line = "".join(source.choices(alphabet, k=source.randrange(28)))
        try:
            frame = parse_line(line)
        except ProtocolError:
            assert line[0] in "tTrR"
            continue
        if frame is not None:
            assert frame.arbitration_id <= (0x1FFF_FFFF if frame.is_extended_id else 0x7FF)
            assert frame.dlc <= 8
