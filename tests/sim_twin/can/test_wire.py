from collections.abc import Callable

import can
import pytest

from sim_twin.can import CanWire, MemoryBus


class Echo:
    """Answer each frame with the next identifier, up to a limit."""

    supplied = True

    def __init__(self, limit: int) -> None:
        self.limit = limit
        self.heard: list[int] = []

    def connect(self, send: Callable[[can.Message], None]) -> None:
        self.send = send

    def receive(self, frame: can.Message) -> None:
        self.heard.append(frame.arbitration_id)
        if frame.arbitration_id < self.limit:
            self.send(message(frame.arbitration_id + 1))


def message(can_id: int) -> can.Message:
    return can.Message(arbitration_id=can_id, is_extended_id=False)


def drained(bus: MemoryBus) -> list[int]:
    return [frame.arbitration_id for frame in iter(bus.recv, None)]


def test_answers_reach_everyone_after_their_cause() -> None:
    one, two = Echo(limit=2), Echo(limit=0)
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


def test_a_bus_that_was_shut_down_hears_nothing_more() -> None:
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

    wire = CanWire([Broken(limit=0)])
    with MemoryBus(wire) as sender:
        for _ in range(2):
            with pytest.raises(RuntimeError, match="firmware bug"):
                sender.send(message(1))
    assert wire.frames_carried == 2
