import threading
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path

import can
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.can_hub import FRAME_BYTES, HubBus, HubLost, decode_frame, encode_frame
from drivers.errors import DeviceBusy, LinkLost, ProtocolError
from sim_twin.can import CanHub, CanWire


def frames() -> st.SearchStrategy[can.Message]:
    classic = st.builds(
        can.Message,
        arbitration_id=st.integers(0, 0x7FF),
        is_extended_id=st.just(False),
        data=st.binary(max_size=8),
    )
    extended_fd = st.builds(
        can.Message,
        arbitration_id=st.integers(0, 0x1FFF_FFFF),
        is_extended_id=st.just(True),
        is_fd=st.just(True),
        bitrate_switch=st.booleans(),
        error_state_indicator=st.booleans(),
        data=st.binary(max_size=64),
    )
    remote = st.builds(
        can.Message,
        arbitration_id=st.integers(0, 0x7FF),
        is_extended_id=st.just(False),
        is_remote_frame=st.just(True),
        dlc=st.integers(0, 8),
    )
    return classic | extended_fd | remote


@given(frames())
def test_a_frame_survives_the_wire(frame: can.Message) -> None:
    packet = encode_frame(frame)
    assert len(packet) == FRAME_BYTES
    assert decode_frame(packet).equals(frame, timestamp_delta=None, check_direction=False)


@given(st.binary(max_size=2 * FRAME_BYTES))
def test_any_packet_is_a_frame_or_a_protocol_error(packet: bytes) -> None:
    try:
        frame = decode_frame(packet)
    except ProtocolError:
        return
    assert len(packet) == FRAME_BYTES
    assert frame.dlc <= 64


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "can"


@pytest.fixture
def hub(path: Path) -> Iterator[CanHub]:
    hub = CanHub(CanWire(), path)
    yield hub
    hub.close()


def opened(hub: CanHub, path: Path) -> HubBus:
    bus = HubBus(str(path))
    hub.poll_once()
    return bus


def test_the_hub_passes_a_frame_to_all_but_its_sender(hub: CanHub, path: Path) -> None:
    with opened(hub, path) as sender, opened(hub, path) as one, opened(hub, path) as two:
        sender.send(can.Message(arbitration_id=0x123, is_extended_id=False, data=b"abc"))
        hub.poll_once()
        for receiver in (one, two):
            frame = receiver.recv(timeout=0.0)
            assert frame is not None
            assert (frame.arbitration_id, bytes(frame.data)) == (0x123, b"abc")
        assert sender.recv(timeout=0.0) is None


def test_the_plug_in_is_found_by_its_name(hub: CanHub, path: Path) -> None:
    with can.Bus(interface="vla_hub", channel=str(path)) as bus:
        assert isinstance(bus, HubBus)
        assert bus.fileno() >= 0


NOVEMBER_2023_S = 1_700_000_000.25


@pytest.mark.parametrize("suffix", [".log", ".blf"])
def test_loggers_keep_the_epoch_that_a_received_frame_is_stamped_with(
    hub: CanHub, path: Path, suffix: str
) -> None:
    file = path.with_suffix(suffix)
    with opened(hub, path) as sender, HubBus(str(path), now_s=lambda: NOVEMBER_2023_S) as bus:
        hub.poll_once()
        sender.send(can.Message(arbitration_id=0x123, is_extended_id=False, data=b"abc"))
        hub.poll_once()
        with can.Logger(file) as logger:
            logger(bus.recv(timeout=0.0))
    with can.LogReader(file) as frames:
        assert [frame.timestamp for frame in frames] == [pytest.approx(NOVEMBER_2023_S, abs=1e-3)]


def test_stamps_are_the_wall_clocks_unless_told_otherwise(hub: CanHub, path: Path) -> None:
    with opened(hub, path) as sender, opened(hub, path) as receiver:
        before_s = datetime.now(UTC).timestamp()
        sender.send(can.Message(arbitration_id=1, is_extended_id=False))
        hub.poll_once()
        frame = receiver.recv(timeout=0.0)
        assert frame is not None
        assert before_s <= frame.timestamp <= datetime.now(UTC).timestamp()


def test_filters_hide_other_frames(hub: CanHub, path: Path) -> None:
    with opened(hub, path) as sender, opened(hub, path) as receiver:
        receiver.set_filters([{"can_id": 0x100, "can_mask": 0x7FF}])
        for can_id in (0x200, 0x100):
            sender.send(can.Message(arbitration_id=can_id, is_extended_id=False))
        hub.poll_once()
        frame = receiver.recv(timeout=0.1)
        assert frame is not None
        assert frame.arbitration_id == 0x100


def test_a_waiting_receiver_wakes_on_a_frame(hub: CanHub, path: Path) -> None:
    with opened(hub, path) as sender, opened(hub, path) as receiver:
        sender.send(can.Message(arbitration_id=1, is_extended_id=False))
        carry = threading.Timer(0.02, hub.poll_once)
        carry.start()
        frame = receiver.recv(timeout=5.0)
        carry.join()
        assert frame is not None


def test_a_closed_hub_is_a_lost_link_in_both_vocabularies(hub: CanHub, path: Path) -> None:
    with opened(hub, path) as bus:
        hub.close()
        with pytest.raises(HubLost) as lost:
            bus.recv(timeout=0.0)
        assert isinstance(lost.value, LinkLost)
        assert isinstance(lost.value, can.CanOperationError)
        with pytest.raises(HubLost):
            bus.send(can.Message(arbitration_id=1, is_extended_id=False))


def test_a_missing_hub_is_an_initialisation_error(tmp_path: Path) -> None:
    with pytest.raises(can.CanInitializationError, match="is the twin running"):
        HubBus(str(tmp_path / "nothing"))


def test_a_hub_that_stops_reading_never_blocks_a_sender(hub: CanHub, path: Path) -> None:
    frame = can.Message(arbitration_id=1, is_extended_id=False)
    with opened(hub, path) as bus, pytest.raises(can.CanTimeoutError):
        for _ in range(100_000):
            bus.send(frame)


def test_a_client_that_stops_reading_loses_its_frames_and_blocks_no_other(
    hub: CanHub, path: Path
) -> None:
    frame = can.Message(arbitration_id=1, is_extended_id=False)
    with opened(hub, path) as sender, opened(hub, path):
        for _ in range(2000):
            sender.send(frame)
            hub.poll_once()
    assert hub.frames_dropped > 0


def test_garbage_from_a_client_is_counted_and_dropped(hub: CanHub, path: Path) -> None:
    with opened(hub, path) as sender, opened(hub, path) as receiver:
        sender._socket.send(b"noise")
        hub.poll_once()
        assert hub.packets_malformed == 1
        assert receiver.recv(timeout=0.0) is None


def test_a_client_that_leaves_is_forgotten(hub: CanHub, path: Path) -> None:
    bus = opened(hub, path)
    assert len(hub.filenos()) == 2
    bus.shutdown()
    hub.poll_once()
    assert len(hub.filenos()) == 1


def test_a_second_hub_is_refused_but_a_dead_ones_socket_is_taken_over(path: Path) -> None:
    first = CanHub(CanWire(), path)
    with pytest.raises(DeviceBusy, match="stop that twin first"):
        CanHub(CanWire(), path)
    first._listener.close()
    CanHub(CanWire(), path).close()
    assert not path.exists()
