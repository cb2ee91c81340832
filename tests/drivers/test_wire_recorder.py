import errno
import os
from collections.abc import Callable
from pathlib import Path

import can
import pytest

from drivers.clock import NS_PER_S
from drivers.errors import DeviceMissing, LinkLost, ProtocolError
from drivers.recording.opener import RecordingOpener, recorded_if_asked
from drivers.recording.recorder import (
    MIN_MAX_BYTES,
    RecordingCanBus,
    RecordingTransport,
    WireRecorder,
)
from drivers.recording.recording import (
    HEAD,
    MAGIC,
    MAX_PAYLOAD_BYTES,
    RecordKind,
    WireRecord,
    decode_can,
    encode_record,
    older_part,
    read_recording,
)
from sim_twin.contracts.scripted import ManualClock


class EchoLine:
    """Answer every write with the same bytes reversed; die on request."""

    def __init__(self) -> None:
        self.pending = b""
        self.dead = False
        self.closed = False

    def write(self, data: bytes) -> None:
        if self.dead:
            raise LinkLost("echo: unplugged")
        self.pending += data[::-1]

    def read(self, max_bytes: int, deadline_ns: int) -> bytes:
        if self.dead:
            raise LinkLost("echo: unplugged")
        data, self.pending = self.pending[:max_bytes], self.pending[max_bytes:]
        return data

    def discard_input(self) -> None:
        self.pending = b""

    def close(self) -> None:
        self.closed = True


@pytest.fixture
def clock() -> ManualClock:
    return ManualClock(7 * NS_PER_S)


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return tmp_path / "servos.wire"


def test_what_passes_is_recorded_in_order_with_its_time(file: Path, clock: ManualClock) -> None:
    line = EchoLine()
    wire = RecordingTransport(line, WireRecorder(file, clock, note="echo at 1000000 baud"))
    wire.write(b"abc")
    clock.ns += 400
    assert wire.read(10, 0) == b"cba"
    assert wire.read(10, 0) == b""
    wire.close()
    assert line.closed
    assert read_recording(file) == [
        WireRecord(RecordKind.NOTE, 7 * NS_PER_S, b"echo at 1000000 baud"),
        WireRecord(RecordKind.WRITE, 7 * NS_PER_S, b"abc"),
        WireRecord(RecordKind.READ, 7 * NS_PER_S + 400, b"cba"),
    ]


def test_a_record_reads_as_a_line(file: Path, clock: ManualClock) -> None:
    wire = RecordingTransport(EchoLine(), WireRecorder(file, clock, note="echo"))
    wire.write(b"\xff\xfd")
    assert [str(record) for record in read_recording(file)] == [
        "7.000000 s note: echo",
        "7.000000 s write: ff fd",
    ]


class FullLine(EchoLine):
    """Offer all that a transport may offer."""

    bauds = (9_600, 57_600)

    def __init__(self) -> None:
        super().__init__()
        self.baud = 9_600

    def read_burst(self, count: int, due_ns: int, deadline_ns: int) -> bytes:
        return self.read(count, deadline_ns)

    def set_baud(self, baud: int) -> None:
        self.baud = baud

    def adapter_fault(self) -> str:
        return "latency timer is 16 ms"


def test_what_a_line_offers_beyond_bytes_is_offered_through_the_recorder(
    file: Path, clock: ManualClock
) -> None:
    line = FullLine()
    wire = RecordingTransport(line, WireRecorder(file, clock))
    wire.write(b"abcdef")
    assert wire.read_burst(6, 0, 0) == b"fedcba"
    assert wire.bauds == (9_600, 57_600)
    wire.set_baud(57_600)
    assert line.baud == 57_600
    assert wire.adapter_fault() == "latency timer is 16 ms"
    assert [record.payload for record in read_recording(file)] == [
        b"abcdef",
        b"fedcba",
        b"57600 baud from here",
    ]


def test_a_line_that_offers_only_bytes_does_not_pretend_more(
    file: Path, clock: ManualClock
) -> None:
    wire = RecordingTransport(EchoLine(), WireRecorder(file, clock))
    wire.write(b"abc")
    wire.write(b"de")
    assert wire.read_burst(4, 0, 0) == b"cbae"
    assert wire.read_burst(4, 0, 0) == b"d"
    assert wire.bauds == ()
    assert wire.adapter_fault() == ""
    with pytest.raises(ValueError, match="this line has one speed only, got 57600"):
        wire.set_baud(57_600)


@pytest.mark.parametrize(
    "act", [lambda w: w.write(b"x"), lambda w: w.read(1, 0), lambda w: w.read_burst(1, 0, 0)]
)
def test_a_lost_link_is_recorded_and_raised(
    act: Callable[[RecordingTransport], object], file: Path, clock: ManualClock
) -> None:
    line = EchoLine()
    wire = RecordingTransport(line, WireRecorder(file, clock))
    line.dead = True
    with pytest.raises(LinkLost):
        act(wire)
    last = read_recording(file)[-1]
    assert (last.kind, last.payload) == (RecordKind.LOST, b"echo: unplugged")


def test_every_record_is_in_the_file_at_once(file: Path, clock: ManualClock) -> None:
    wire = RecordingTransport(EchoLine(), WireRecorder(file, clock))
    for count in range(1, 20):
        wire.write(bytes(count))
        assert len(read_recording(file)) == count, "nothing waits for a close that may never come"


def test_a_record_cut_anywhere_costs_only_itself(file: Path, clock: ManualClock) -> None:
    wire = RecordingTransport(EchoLine(), WireRecorder(file, clock))
    wire.write(b"first")
    whole = file.stat().st_size
    wire.write(b"second")
    content = file.read_bytes()
    for end in range(whole, len(content)):
        file.write_bytes(content[:end])
        assert [record.payload for record in read_recording(file)] == [b"first"]


def test_a_record_with_a_wrong_bit_ends_the_reading(file: Path, clock: ManualClock) -> None:
    wire = RecordingTransport(EchoLine(), WireRecorder(file, clock))
    for payload in (b"first", b"second"):
        wire.write(payload)
    content = file.read_bytes()
    start = len(MAGIC) + HEAD.size + len(b"first")
    for at in range(start, len(content)):
        spoiled = content[:at] + bytes([content[at] ^ 0x10]) + content[at + 1 :]
        file.write_bytes(spoiled)
        assert [record.payload for record in read_recording(file)] == [b"first"]


def test_the_file_keeps_the_newest_records_within_its_bound(file: Path, clock: ManualClock) -> None:
    recorder = WireRecorder(file, clock, note="bounded", max_bytes=MIN_MAX_BYTES)
    for number in range(3000):
        recorder.record(RecordKind.WRITE, number.to_bytes(4, "little") * 100)
        total = sum(path.stat().st_size for path in file.parent.iterdir())
        assert total <= MIN_MAX_BYTES
    numbers = [
        int.from_bytes(record.payload[:4], "little")
        for record in read_recording(file)
        if record.kind is RecordKind.WRITE
    ]
    assert numbers == list(range(numbers[0], 3000))
    assert len(numbers) * 400 > MIN_MAX_BYTES / 3


def test_a_new_recording_replaces_the_earlier_one_with_its_older_part(
    file: Path, clock: ManualClock
) -> None:
    recorder = WireRecorder(file, clock, max_bytes=MIN_MAX_BYTES)
    for _ in range(400):
        recorder.record(RecordKind.READ, bytes(1000))
    assert older_part(file).exists()
    WireRecorder(file, clock, note="new").close()
    assert [record.payload for record in read_recording(file)] == [b"new"]


def test_a_payload_longer_than_a_record_becomes_several(file: Path, clock: ManualClock) -> None:
    long = os.urandom(MAX_PAYLOAD_BYTES + 5)
    WireRecorder(file, clock).record(RecordKind.READ, long)
    records = read_recording(file)
    assert len(records) == 2
    assert b"".join(record.payload for record in records) == long
    with pytest.raises(ValueError, match=r"holds 0\.\.65535 bytes, got 65536"):
        encode_record(RecordKind.READ, 0, bytes(MAX_PAYLOAD_BYTES + 1))


def test_a_full_disk_ends_the_recording_and_not_the_wire(
    file: Path,
    clock: ManualClock,
    monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
) -> None:
    wire = RecordingTransport(EchoLine(), WireRecorder(file, clock))

    def full(*_: object) -> int:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr("drivers.recording.recorder.os.write", full)
    for _ in range(3):
        wire.write(b"ab")
    assert wire.read(6, 0) == b"bababa"
    assert [record.message for record in caplog.records] == [
        f"{file}: recording ended: No space left on device"
    ]


def test_what_is_no_recording_is_refused(tmp_path: Path) -> None:
    (tmp_path / "text").write_text("hello, I am a text")
    with pytest.raises(ProtocolError, match="not a wire recording"):
        read_recording(tmp_path / "text")
    with pytest.raises(DeviceMissing, match="name a wire recording"):
        read_recording(tmp_path / "nothing")


def test_a_place_that_cannot_be_written_and_a_tiny_bound_are_refused(
    tmp_path: Path, clock: ManualClock
) -> None:
    with pytest.raises(DeviceMissing, match="choose another file"):
        WireRecorder(tmp_path / "no" / "such" / "folder.wire", clock)
    with pytest.raises(ValueError, match="needs at least"):
        WireRecorder(tmp_path / "a.wire", clock, max_bytes=100)


def frames() -> list[can.Message]:
    return [
        can.Message(arbitration_id=0x181, data=b"\x01\x02", is_extended_id=False),
        can.Message(arbitration_id=0x1FFFFFFF, data=b"", is_extended_id=True),
        can.Message(arbitration_id=0x701, is_remote_frame=True, is_extended_id=False, dlc=3),
        can.Message(arbitration_id=5, data=bytes(64), is_fd=True, bitrate_switch=True),
    ]


def test_can_frames_are_recorded_both_ways_and_come_back_as_they_were(
    file: Path, clock: ManualClock
) -> None:
    with can.Bus(interface="virtual", channel="recorder", protocol=can.CanProtocol.CAN_FD) as peer:
        inner = can.Bus(interface="virtual", channel="recorder", protocol=can.CanProtocol.CAN_FD)
        bus = RecordingCanBus(inner, WireRecorder(file, clock))
        for frame in frames():
            bus.send(frame)
            assert peer.recv(1.0) is not None
            peer.send(frame)
            assert bus.recv(1.0) is not None
        assert bus.recv(0.0) is None
        bus.shutdown()
    records = read_recording(file)
    assert [record.kind for record in records] == [
        RecordKind.CAN_SENT,
        RecordKind.CAN_RECEIVED,
    ] * len(frames())
    for frame, *pair in zip(frames(), records[::2], records[1::2], strict=True):
        for record in pair:
            got = decode_can(record)
            assert got.equals(frame, timestamp_delta=None, check_direction=False)
            assert got.timestamp == 7.0
    with pytest.raises(ProtocolError, match="expected a CAN frame"):
        decode_can(WireRecord(RecordKind.READ, 0, b"no frame"))


class OneLineOpener:
    def serial(self, name: str) -> EchoLine:
        return EchoLine()

    def stream(self, name: str) -> EchoLine:
        return EchoLine()

    def can(self, name: str) -> can.BusABC:
        return can.Bus(interface="virtual", channel=name)


def test_an_opener_records_each_device_each_time_it_is_opened(
    tmp_path: Path, clock: ManualClock
) -> None:
    opener = recorded_if_asked(OneLineOpener(), clock, str(tmp_path / "run"))
    for _ in range(12):
        opener.serial("servos").write(b"hello")
    opener.can("can").shutdown()
    assert isinstance(opener.stream("camera"), EchoLine)
    names = {path.name for path in (tmp_path / "run").iterdir()}
    assert names == {"can-1.wire"} | {f"servos-{n}.wire" for n in range(5, 13)}
    note, write = read_recording(tmp_path / "run" / "servos-12.wire")
    assert (note.payload, write.payload) == (b"device servos", b"hello")


def test_nothing_is_recorded_unless_asked(clock: ManualClock) -> None:
    opener = OneLineOpener()
    assert recorded_if_asked(opener, clock, None) is opener


def test_a_recording_directory_that_cannot_be_made_is_refused(
    tmp_path: Path, clock: ManualClock
) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(DeviceMissing, match="choose another directory"):
        RecordingOpener(OneLineOpener(), tmp_path / "file" / "run", clock)
