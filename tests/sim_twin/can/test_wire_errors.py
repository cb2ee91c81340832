import errno
from collections.abc import Callable, Iterator

import can
import pytest

from sim_twin.can import CanWire, MemoryBus
from sim_twin.can.bus.error_counters import ErrorCounters, ErrorState
from sim_twin.can.bus.error_frames import BUS_OFF, CONTROLLER, NO_ACKNOWLEDGEMENT, RESTARTED
from sim_twin.can.bus.station import QUEUE_FRAMES

MS = 1_000_000


class Node:
    """Acknowledge, and note frames and the error frames of its own controller."""

    def __init__(self) -> None:
        self.supplied = True
        self.heard: list[int] = []
        self.errors: list[int] = []

    def connect(self, send: Callable[[can.Message], None]) -> None:
        self.send = send

    def receive(self, frame: can.Message) -> None:
        (self.errors if frame.is_error_frame else self.heard).append(frame.arbitration_id)


class Bench:
    """One node, one port, and time that passes in steps of 2 ms."""

    def __init__(self, **options: object) -> None:
        self.node = Node()
        self.wire = CanWire([self.node], **options)  # type: ignore[arg-type]
        self.bus = MemoryBus(self.wire)
        self.now_ns = 0

    def pass_time(self, duration_s: float) -> None:
        for _ in range(round(duration_s * 500)):
            self.now_ns += 2 * MS
            self.wire.poll(self.now_ns)

    def error_frames(self) -> list[can.Message]:
        return [frame for frame in iter(self.bus.recv, None) if frame.is_error_frame]

    def state(self) -> ErrorState:
        return self.wire.health(self.bus.port).state


def message(can_id: int = 0x123, data: bytes = b"") -> can.Message:
    return can.Message(arbitration_id=can_id, is_extended_id=False, data=data)


@pytest.fixture(params=[False, True], ids=["untimed", "timed"])
def bench(request: pytest.FixtureRequest) -> Iterator[Bench]:
    bench = Bench(timed=request.param)
    yield bench
    bench.bus.shutdown()


def test_the_counters_follow_the_standard() -> None:
    counters = ErrorCounters()
    for _ in range(16):
        counters.transmit_failed()
    assert (counters.tec, counters.state) == (128, ErrorState.PASSIVE)
    counters.transmitted()
    assert (counters.tec, counters.state) == (127, ErrorState.WARNING)
    for _ in range(17):
        counters.transmit_failed()
    assert (counters.tec, counters.state) == (256, ErrorState.BUS_OFF)
    counters.reset()
    for _ in range(128):
        counters.receive_failed(first=False)
    assert counters.state is ErrorState.PASSIVE
    counters.received()
    assert 119 <= counters.rec <= 127


def test_alone_on_the_bus_a_sender_becomes_passive_but_never_bus_off(bench: Bench) -> None:
    bench.wire.cut = True
    bench.bus.send(message())
    bench.pass_time(0.2)
    assert bench.wire.health(bench.bus.port).tec == 128
    assert bench.state() is ErrorState.PASSIVE
    assert bench.node.heard == []
    bench.wire.cut = False
    bench.pass_time(0.01)
    assert bench.node.heard == [0x123]
    assert bench.wire.health(bench.bus.port).tec == 127


def test_a_node_without_power_acknowledges_nothing(bench: Bench) -> None:
    bench.node.supplied = False
    bench.bus.send(message())
    bench.pass_time(0.1)
    assert bench.state() is ErrorState.PASSIVE


def test_a_full_queue_refuses_as_socketcan_does(bench: Bench) -> None:
    bench.wire.cut = True
    for _ in range(QUEUE_FRAMES):
        bench.bus.send(message())
    with pytest.raises(can.CanOperationError) as refusal:
        bench.bus.send(message())
    assert refusal.value.error_code == errno.ENOBUFS
    assert bench.wire.health(bench.bus.port).frames_refused == 1


def test_a_damaged_frame_is_sent_again_and_never_handed_on_damaged(bench: Bench) -> None:
    bench.wire.corrupt(0.3, seed=1)
    for value in range(100):
        bench.bus.send(message(value))
        bench.pass_time(0.004)
    assert bench.node.heard == list(range(100))
    assert bench.wire.frames_destroyed == pytest.approx(43, abs=20)
    assert bench.state() is not ErrorState.BUS_OFF


def test_when_every_frame_is_damaged_the_sender_goes_bus_off_after_32_attempts(
    bench: Bench,
) -> None:
    bench.wire.corrupt(1.0)
    bench.bus.send(message())
    bench.pass_time(0.02)
    assert bench.state() is ErrorState.BUS_OFF
    assert bench.wire.frames_destroyed == 32
    assert bench.wire.health(bench.node).rec == 32
    reported = bench.error_frames()
    assert [frame.arbitration_id & (BUS_OFF | CONTROLLER) for frame in reported] == [
        CONTROLLER,
        CONTROLLER,
        BUS_OFF,
    ]
    with pytest.raises(can.CanOperationError):
        bench.bus.send(message())


def test_a_controller_restarts_by_itself_after_the_configured_time(bench: Bench) -> None:
    bench.wire.corrupt(1.0)
    bench.bus.send(message())
    bench.pass_time(0.02)
    bench.wire.corrupt(0.0)
    bench.pass_time(0.06)
    assert bench.state() is ErrorState.BUS_OFF
    bench.pass_time(0.06)
    assert bench.state() is ErrorState.ACTIVE
    assert bench.error_frames()[-1].arbitration_id & RESTARTED
    bench.bus.send(message(0x77))
    bench.pass_time(0.002)
    assert bench.node.heard == [0x77]


def test_a_forced_bus_off_lasts_until_the_restart_and_128_times_11_bits(bench: Bench) -> None:
    bench.wire.set_bus_off()
    bench.pass_time(1.0)
    assert bench.state() is ErrorState.BUS_OFF
    bench.wire.restart()
    assert bench.wire.next_due_ns() == bench.now_ns + 1408 * 1000
    bench.wire.poll(bench.now_ns + 1407 * 1000)
    assert bench.state() is ErrorState.BUS_OFF
    bench.wire.poll(bench.now_ns + 1408 * 1000)
    assert bench.state() is ErrorState.ACTIVE


def test_reopening_the_interface_does_not_end_a_forced_bus_off(bench: Bench) -> None:
    bench.wire.set_bus_off()
    with MemoryBus(bench.wire) as second:
        frame = second.recv()
        assert frame is not None
        assert frame.arbitration_id & BUS_OFF
        with pytest.raises(can.CanOperationError):
            second.send(message())
        bench.wire.restart()
        bench.pass_time(0.004)
        second.send(message())
        bench.pass_time(0.002)
    assert bench.node.heard == [0x123]


def test_a_node_can_be_taken_off_the_bus(bench: Bench) -> None:
    bench.wire.set_bus_off(bench.node)
    bench.bus.send(message())
    bench.pass_time(0.01)
    assert bench.node.heard == []
    bench.wire.restart(bench.node)
    bench.pass_time(0.01)
    assert bench.node.heard == [0x123]
    assert [frame & (BUS_OFF | RESTARTED) for frame in bench.node.errors] == [BUS_OFF, RESTARTED]


def test_a_node_at_a_wrong_bit_rate_destroys_frames_until_it_is_passive(bench: Bench) -> None:
    bench.wire.add_node(other := Node())
    bench.wire.set_wrong_bitrate(bench.node)
    bench.bus.send(message())
    bench.pass_time(0.01)
    assert other.heard == [0x123]
    assert bench.node.heard == []
    assert bench.wire.frames_destroyed == 15  # 9 a frame, until 128
    assert bench.wire.health(bench.node).rec >= 128
    assert bench.state() is ErrorState.WARNING


def test_a_sender_at_a_wrong_bit_rate_ends_bus_off(bench: Bench) -> None:
    bench.wire.set_wrong_bitrate(bench.node)
    bench.node.send(message())
    bench.pass_time(0.02)
    assert bench.wire.health(bench.node).state is ErrorState.BUS_OFF
    assert bench.state() is ErrorState.ACTIVE


def test_two_nodes_of_one_identifier_destroy_each_other_until_one_gives_way(bench: Bench) -> None:
    bench.wire.add_node(other := Node())
    bench.bus.send(message(0x001))
    bench.node.send(message(0x181, b"\x01"))
    other.send(message(0x181, b"\x02"))
    bench.pass_time(0.02)
    carried = [frame for frame in iter(bench.bus.recv, None) if not frame.is_error_frame]
    assert sorted(bytes(frame.data) for frame in carried) == [b"\x01", b"\x02"]
    if bench.wire.timed:  # without time the first is over before the second begins
        assert bench.wire.frames_destroyed == 16
        assert bench.wire.health(other).tec > bench.wire.health(bench.node).tec


def test_lost_frames_are_no_error_of_any_node(bench: Bench) -> None:
    bench.wire.drop_every(3)
    for value in range(9):
        bench.bus.send(message(value))
        bench.pass_time(0.002)
    assert bench.node.heard == [0, 1, 3, 4, 6, 7]
    assert bench.wire.frames_lost == 3
    assert bench.wire.health(bench.bus.port).tec == 0


def test_losing_a_share_is_the_same_for_the_same_seed() -> None:
    heard = []
    for seed in (5, 5, 6):
        bench = Bench()
        bench.wire.drop_ratio(0.5, seed)
        for value in range(100):
            bench.bus.send(message(value))
        heard.append(bench.node.heard)
        bench.bus.shutdown()
    assert heard[0] == heard[1] != heard[2]
    assert 30 < len(heard[0]) < 70


def test_a_delayed_frame_comes_late_and_in_order(bench: Bench) -> None:
    bench.wire.delay(0.05)
    bench.bus.send(message(1))
    bench.bus.send(message(2))
    bench.pass_time(0.048)
    assert bench.node.heard == []
    bench.pass_time(0.006)
    assert bench.node.heard == [1, 2]


def test_single_errors_are_reported_only_on_request() -> None:
    frames: list[can.Message] = []
    wire = CanWire([Node()])
    wire.attach(frames.append, report_bus_errors=True)
    wire.cut = True
    wire.send(message(), frames.append)
    assert frames[0].is_error_frame
    assert frames[0].arbitration_id & NO_ACKNOWLEDGEMENT
    assert frames[0].data[6] == 8


def test_fd_frames_are_errors_to_classic_controllers(bench: Bench) -> None:
    bench.bus.send(can.Message(arbitration_id=1, is_extended_id=False, is_fd=True, data=bytes(12)))
    bench.pass_time(0.02)
    assert bench.node.heard == []
    assert bench.state() is ErrorState.BUS_OFF


@pytest.mark.parametrize("ratio", [-0.1, 1.1])
def test_a_share_that_is_none_is_refused(ratio: float) -> None:
    wire = CanWire()
    with pytest.raises(ValueError, match=r"expected 0\.\.1"):
        wire.corrupt(ratio)
    with pytest.raises(ValueError, match=r"expected 0\.\.1"):
        wire.drop_ratio(ratio)
