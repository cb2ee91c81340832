from collections.abc import Callable

import can
import pytest

from sim_twin.can import CanWire, MemoryBus
from sim_twin.can.bus.frame_bits import INTERMISSION_BITS, frame_bits

BITRATE = 500_000
BIT_NS = 2_000


class Echo:
    """Acknowledge and note each frame, and answer it with the next identifier up to a limit."""

    supplied = True

    def __init__(self, limit: int = 0) -> None:
        self.limit = limit
        self.heard: list[int] = []

    def connect(self, send: Callable[[can.Message], None]) -> None:
        self.send = send

    def receive(self, frame: can.Message) -> None:
        if frame.is_error_frame:
            return
        self.heard.append(frame.arbitration_id)
        if frame.arbitration_id < self.limit:
            self.send(message(frame.arbitration_id + 1))


def message(can_id: int, data: bytes = b"") -> can.Message:
    return can.Message(arbitration_id=can_id, is_extended_id=False, data=data)


def drained(bus: MemoryBus) -> list[int]:
    return [frame.arbitration_id for frame in iter(bus.recv, None)]


def test_answers_reach_everyone_after_their_cause() -> None:
    one, two = Echo(limit=2), Echo()
    wire = CanWire([one, two])
    with MemoryBus(wire) as sender, MemoryBus(wire) as listener:
        sender.send(message(1))
        assert drained(listener) == [1, 2]
        assert drained(sender) == [2]
    assert two.heard == [1, 2]
    assert one.heard == [1]
    assert wire.frames_carried == 2


def test_the_same_frame_of_two_nodes_melts_into_one() -> None:
    wire = CanWire([Echo(limit=5), Echo(limit=5)])
    with MemoryBus(wire) as bus:
        bus.send(message(4))
        assert drained(bus) == [5]


def test_a_cut_wire_separates_computer_and_nodes_only() -> None:
    node = Echo(limit=9)
    wire = CanWire([node])
    wire.cut = True
    with MemoryBus(wire) as sender, MemoryBus(wire) as listener:
        sender.send(message(1))
        node.send(message(7))
        assert drained(listener) == [1]
        assert drained(sender) == []
    assert node.heard == []


def test_a_bus_that_was_shut_down_receives_nothing_more() -> None:
    wire = CanWire()
    with MemoryBus(wire) as sender:
        listener = MemoryBus(wire)
        listener.shutdown()
        listener.shutdown()
        sender.send(message(1))
        assert drained(listener) == []


def test_waiting_for_a_frame_never_takes_wall_time() -> None:
    with MemoryBus(CanWire()) as bus:
        assert bus.recv(timeout=3600.0) is None
        assert bus.recv(timeout=None) is None


def test_a_failing_node_does_not_jam_the_wire() -> None:
    class Broken(Echo):
        def receive(self, frame: can.Message) -> None:
            raise RuntimeError("firmware bug")

    wire = CanWire([Broken()])
    with MemoryBus(wire) as sender:
        for _ in range(2):
            with pytest.raises(RuntimeError, match="firmware bug"):
                sender.send(message(1))
    assert wire.frames_carried == 2


def test_a_frame_arrives_when_its_bits_are_over() -> None:
    node = Echo()
    wire = CanWire([node], bitrate=BITRATE, timed=True)
    wire.poll(1_000_000)
    frame = message(0x123, b"12345678")
    end_ns = 1_000_000 + frame_bits(frame) * BIT_NS
    with MemoryBus(wire) as bus:
        bus.send(frame)
        assert wire.next_due_ns() == end_ns
        wire.poll(end_ns - 1)
        assert node.heard == []
        wire.poll(end_ns)
        assert node.heard == [0x123]
    assert wire.next_due_ns() is None


def test_frames_follow_each_other_after_the_intermission() -> None:
    node = Echo()
    wire = CanWire([node], bitrate=BITRATE, timed=True)
    frames = [message(0x100 + row, bytes(row)) for row in range(8)]
    with MemoryBus(wire) as bus:
        for frame in frames:
            bus.send(frame)
        bits = sum(frame_bits(frame) + INTERMISSION_BITS for frame in frames) - INTERMISSION_BITS
        wire.poll(bits * BIT_NS - 1)
        assert len(node.heard) == 7
        wire.poll(bits * BIT_NS)
    assert node.heard == [frame.arbitration_id for frame in frames]


def test_the_lowest_identifier_wins_and_the_losers_are_counted() -> None:
    nodes = [Echo() for _ in range(3)]
    wire = CanWire(nodes, bitrate=BITRATE, timed=True)
    with MemoryBus(wire) as bus:
        bus.send(message(0x050))  # holds the wire while the others get ready
        for node, can_id in zip(nodes, (0x300, 0x100, 0x200), strict=True):
            node.send(message(can_id))
        wire.poll(10_000_000)
        assert drained(bus) == [0x100, 0x200, 0x300]
    assert [wire.health(node).arbitration_losses for node in nodes] == [2, 0, 1]


def test_twice_the_bit_rate_is_half_the_time() -> None:
    ends = []
    for bitrate in (250_000, 500_000):
        wire = CanWire([Echo()], bitrate=bitrate, timed=True)
        with MemoryBus(wire) as bus:
            bus.send(message(0x7FF, b"\xff" * 8))
            ends.append(wire.next_due_ns())
    assert ends[0] == 2 * (ends[1] or 0) > 0


def test_a_babbling_node_keeps_all_others_waiting_until_it_stops() -> None:
    node = Echo()
    wire = CanWire([node], bitrate=BITRATE)
    with MemoryBus(wire) as bus:
        wire.babble(0x000, on=True)
        bus.send(message(0x100))
        for step in range(1, 6):
            wire.poll(step * 2_000_000)
        flood = drained(bus)
        assert set(flood) == {0x000}
        assert len(flood) == pytest.approx(10_000_000 / (117 * BIT_NS), rel=0.1)
        assert 0x100 not in node.heard
        assert wire.health(bus.port).arbitration_losses >= len(flood)
        wire.babble(on=False)
        wire.poll(12_000_000)
        assert node.heard[-1] == 0x100


def test_a_babbler_of_low_priority_only_costs_time() -> None:
    node = Echo()
    wire = CanWire([node], bitrate=BITRATE)
    with MemoryBus(wire) as bus:
        wire.babble(0x7FF, on=True)
        wire.poll(1_000_000)
        bus.send(message(0x100))
        wire.poll(2_000_000)
    assert 0x100 in node.heard


def test_a_wire_in_use_can_be_given_and_spared_the_time_of_its_bits() -> None:
    heard: list[can.Message] = []
    wire = CanWire()
    wire.attach(heard.append)
    wire.attach(sender := [].append)
    wire.timed = True
    wire.poll(0)
    wire.send(can.Message(arbitration_id=1, is_extended_id=False, data=bytes(8)), sender)
    assert heard == []
    wire.poll(200_000)
    assert len(heard) == 1
    wire.timed = False
    wire.poll(400_000)
    wire.send(can.Message(arbitration_id=2, is_extended_id=False, data=bytes(8)), sender)
    assert len(heard) == 2
