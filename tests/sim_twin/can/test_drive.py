from collections.abc import Iterator

import can
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.canopen.objects import RPDO1, AbortConnection, NmtState
from drivers.wheel_drives.bus import PowerState
from sim_twin.can import CanWire, MemoryBus, WheelDrive
from sim_twin.can.free_wheel import STEP_NS, FreeWheel

ENABLING = (0x06, 0x07, 0x0F)
HOST = 0x7F
COUNTS_PER_RAD = 16384 / 6.283185307179586


class Host:
    """Talk to one drive frame by frame and let time pass."""

    def __init__(self, node_id: int = 1) -> None:
        self.drive = WheelDrive(node_id)
        self.wheel = FreeWheel(self.drive)
        self.wire = CanWire([self.drive])
        self.bus = MemoryBus(self.wire)
        self.now_ns = 0
        self.pass_time(0.002)
        assert self.received() == [(0x700 + node_id, b"\x00")]

    def pass_time(self, duration_s: float) -> None:
        for _ in range(round(duration_s * 1e9 / STEP_NS)):
            self.now_ns += STEP_NS
            self.wheel.step(self.now_ns, STEP_NS / 1e9)
            self.wire.poll(self.now_ns)

    def send(self, can_id: int, data: bytes = b"", **flags: bool) -> list[tuple[int, bytes]]:
        self.bus.send(
            can.Message(arbitration_id=can_id, data=data, **{"is_extended_id": False, **flags})
        )
        return self.received()

    def received(self) -> list[tuple[int, bytes]]:
        frames = iter(self.bus.recv, None)
        return [(frame.arbitration_id, bytes(frame.data)) for frame in frames]

    def command(self, controlword: int, velocity_rad_s: float = 0.0) -> None:
        target = round(velocity_rad_s * COUNTS_PER_RAD)
        self.send(0x201, RPDO1.wire.pack(controlword, target))

    def write(self, index: int, subindex: int, value: int, size: int) -> None:
        head = bytes((0x23 | (4 - size) << 2,)) + index.to_bytes(2, "little") + bytes((subindex,))
        data = value.to_bytes(size, "little").ljust(4, b"\0")
        ((_, reply),) = self.send(0x601, head + data)
        assert reply[0] == 0x60, reply.hex()

    def enable(self, velocity_rad_s: float = 0.0) -> None:
        self.send(0x000, b"\x01\x01")
        for controlword in ENABLING:
            self.command(controlword, velocity_rad_s)
        assert self.drive.power_state is PowerState.OPERATION_ENABLED

    def watch(self, limit_ms: int) -> None:
        self.write(0x1016, 1, HOST << 16 | limit_ms, 4)
        self.send(0x700 + HOST, b"\x05")


@pytest.fixture
def host() -> Iterator[Host]:
    host = Host()
    yield host
    host.bus.shutdown()


def test_process_data_flow_only_in_operational(host: Host) -> None:
    states = []
    for nmt, answers in ((b"\x80\x00", []), (b"\x01\x00", [0x181, 0x281])):
        host.send(0x000, nmt)
        assert [can_id for can_id, _ in host.send(0x080)] == answers
        host.command(0x06)
        states.append(host.drive.power_state)
    assert states == [PowerState.SWITCH_ON_DISABLED, PowerState.READY_TO_SWITCH_ON]


def test_stopped_answers_nothing_and_takes_the_motor_down(host: Host) -> None:
    host.enable(5.0)
    host.pass_time(0.5)
    host.send(0x000, b"\x02\x01")
    assert host.send(0x601, bytes.fromhex("4041600000000000")) == []
    host.pass_time(0.3)
    assert host.drive.power_state is PowerState.FAULT
    assert abs(host.wheel.velocity_rad_s) < 0.02


def test_a_reset_boots_with_defaults_and_without_power(host: Host) -> None:
    host.write(0x6083, 0, 77, 4)
    host.enable(3.0)
    assert host.send(0x000, b"\x81\x01") == [(0x701, b"\x00")]
    assert host.drive.power_state is PowerState.SWITCH_ON_DISABLED
    assert host.drive.nmt_state is NmtState.PRE_OPERATIONAL
    ((_, reply),) = host.send(0x601, bytes.fromhex("4083600000000000"))
    assert int.from_bytes(reply[4:8], "little") == 52152


def test_commands_for_other_nodes_are_ignored(host: Host) -> None:
    host.send(0x000, b"\x01\x02")
    assert host.drive.nmt_state is NmtState.PRE_OPERATIONAL


def test_the_heartbeat_comes_at_its_period(host: Host) -> None:
    host.write(0x1017, 0, 20, 2)
    host.pass_time(0.2)
    beats = [data for can_id, data in host.received() if can_id == 0x701]
    assert beats == [b"\x7f"] * len(beats)
    assert 10 <= len(beats) <= 11


def test_the_watch_begins_with_the_first_heartbeat(host: Host) -> None:
    host.write(0x1016, 1, HOST << 16 | 50, 4)
    host.enable()
    host.pass_time(0.5)
    assert host.drive.power_state is PowerState.OPERATION_ENABLED
    host.send(0x700 + HOST, b"\x05")
    host.pass_time(0.06)
    assert host.drive.power_state is not PowerState.OPERATION_ENABLED


@pytest.mark.parametrize(
    ("option", "final"),
    [
        (AbortConnection.NOTHING, PowerState.OPERATION_ENABLED),
        (AbortConnection.FAULT, PowerState.FAULT),
        (AbortConnection.DISABLE_VOLTAGE, PowerState.SWITCH_ON_DISABLED),
        (AbortConnection.QUICK_STOP, PowerState.SWITCH_ON_DISABLED),
    ],
)
def test_a_lost_host_has_the_configured_consequence(
    host: Host, option: AbortConnection, final: PowerState
) -> None:
    host.write(0x6007, 0, option, 2)
    host.watch(50)
    host.enable()
    host.pass_time(0.3)
    assert host.drive.power_state is final
    assert (0x081, bytes.fromhex("3081 11 0000000000")) in host.received()


@pytest.mark.parametrize(
    ("option", "final"),
    [
        (0, PowerState.SWITCH_ON_DISABLED),
        (1, PowerState.SWITCH_ON_DISABLED),
        (2, PowerState.SWITCH_ON_DISABLED),
        (5, PowerState.QUICK_STOP_ACTIVE),
        (6, PowerState.QUICK_STOP_ACTIVE),
    ],
)
def test_a_quick_stop_ends_as_605a_says(host: Host, option: int, final: PowerState) -> None:
    host.write(0x605A, 0, option, 2)
    host.enable(4.0)
    host.pass_time(0.5)
    host.command(0x02)
    host.pass_time(0.01)
    at_once = PowerState.SWITCH_ON_DISABLED if option == 0 else PowerState.QUICK_STOP_ACTIVE
    assert host.drive.power_state is at_once
    host.pass_time(0.5)
    assert host.drive.power_state is final


def test_the_quick_stop_brakes_at_its_own_deceleration(host: Host) -> None:
    host.write(0x6085, 0, round(10.0 * COUNTS_PER_RAD), 4)
    host.enable(6.0)
    host.pass_time(0.6)
    host.command(0x02)
    host.pass_time(0.3)
    assert host.wheel.velocity_rad_s == pytest.approx(3.0, abs=0.2)


def test_a_blocked_wheel_keeps_its_power_until_the_ramp_has_ended(host: Host) -> None:
    host.enable(4.0)
    host.pass_time(0.5)
    host.command(0x02)
    states = []
    for _ in range(100):
        host.now_ns += STEP_NS
        host.drive.advance(host.now_ns, 0.0, 0.0)
        states.append(host.drive.power_state)
    powered_steps = states.count(PowerState.QUICK_STOP_ACTIVE)
    assert powered_steps * STEP_NS / 1e9 == pytest.approx(4.0 / 40.0, abs=0.005)
    assert states[-1] is PowerState.SWITCH_ON_DISABLED


def test_halt_brakes_but_keeps_the_power(host: Host) -> None:
    host.enable(4.0)
    host.pass_time(0.5)
    host.command(0x10F, 4.0)
    host.pass_time(0.5)
    assert abs(host.wheel.velocity_rad_s) < 0.05
    assert host.drive.power_state is PowerState.OPERATION_ENABLED


def test_cyclic_synchronous_velocity_follows_without_a_ramp(host: Host) -> None:
    host.write(0x6060, 0, 9, 1)
    host.enable(1.0)
    host.pass_time(0.1)
    assert host.wheel.velocity_rad_s == pytest.approx(1.0, abs=0.02)


def test_the_torque_never_exceeds_its_limit(host: Host) -> None:
    host.write(0x6060, 0, 9, 1)
    host.enable(1000.0)
    assert host.drive.advance(host.now_ns + STEP_NS, 0.0, 0.0) == 4.0
    ((_, status), _) = host.send(0x080)
    assert int.from_bytes(status[:2], "little") & 1 << 11


def test_without_power_there_is_no_torque(host: Host) -> None:
    assert host.drive.advance(host.now_ns + STEP_NS, 1.0, 5.0) == 0.0
    host.enable(5.0)
    host.drive.set_supply(on=False)
    assert host.drive.advance(host.now_ns + 2 * STEP_NS, 1.0, 0.0) == 0.0
    assert host.send(0x080) == []


def test_the_encoder_counts_whole_steps_from_power_on(host: Host) -> None:
    host.send(0x000, b"\x01\x01")
    host.drive.advance(host.now_ns + STEP_NS, 1.0001, 0.0)
    _, (_, position) = host.send(0x080)
    assert int.from_bytes(position[:4], "little", signed=True) == round(1.0001 * COUNTS_PER_RAD)
    host.drive.set_supply(on=False)
    host.drive.set_supply(on=True)
    host.send(0x000, b"\x01\x01")
    host.drive.advance(host.now_ns + 2 * STEP_NS, 1.0001, 0.0)
    _, (_, position) = host.send(0x080)[-2:]
    assert position[:4] == bytes(4)


def test_a_power_cycle_forgets_the_parameters(host: Host) -> None:
    host.write(0x1017, 0, 20, 2)
    host.drive.set_supply(on=False)
    host.drive.set_supply(on=True)
    assert host.received() == [(0x701, b"\x00")]
    host.pass_time(0.2)
    assert host.received() == []


def test_the_error_history_keeps_the_latest_first_and_can_be_cleared(host: Host) -> None:
    for code in range(0x1001, 0x1007):
        host.drive.raise_fault(code)
    replies = [host.send(0x601, bytes((0x40, 3, 0x10, row, 0, 0, 0, 0)))[-1][1] for row in range(5)]
    assert replies[0][4] == 4
    assert [reply[4] for reply in replies[1:]] == [6, 5, 4, 3]
    host.write(0x1003, 0, 0, 1)
    assert host.send(0x601, bytes.fromhex("4003100000000000"))[0][1][4] == 0


@given(
    frames=st.lists(
        st.tuples(
            st.sampled_from([0x000, 0x080, 0x201, 0x601, 0x77F, 0x081, 0x7E5]),
            st.binary(max_size=8),
        ),
        max_size=60,
    )
)
def test_no_sequence_of_frames_breaks_the_drive(frames: list[tuple[int, bytes]]) -> None:
    host = Host()
    for can_id, data in frames:
        host.send(can_id, data)
        host.pass_time(0.002)
        torque_nm = host.drive.advance(host.now_ns, 0.0, 0.0)
        assert abs(torque_nm) <= 4.0
    assert host.send(0x000, b"\x81\x01") == [(0x701, b"\x00")]
    host.enable()
    host.bus.shutdown()


@pytest.mark.parametrize("flag", ["is_extended_id", "is_remote_frame", "is_error_frame"])
def test_frames_of_another_kind_are_no_commands(host: Host, flag: str) -> None:
    host.send(0x000, b"" if flag == "is_remote_frame" else b"\x01\x01", **{flag: True})
    assert host.drive.nmt_state is NmtState.PRE_OPERATIONAL


def state(host: Host) -> PowerState:
    return host.drive.power_state


def emergencies(host: Host) -> list[int]:
    return [
        int.from_bytes(data[:2], "little") for can_id, data in host.received() if can_id == 0x081
    ]


def test_an_undervoltage_faults_an_enabled_drive_only(host: Host) -> None:
    host.drive.set_supply_v(12.0)
    host.pass_time(0.01)
    assert state(host) is PowerState.SWITCH_ON_DISABLED
    host.enable()
    host.pass_time(0.01)
    assert state(host) is PowerState.FAULT
    assert emergencies(host) == [0x3220]


def test_a_brown_out_reboots_the_drive(host: Host) -> None:
    host.drive.set_supply_v(5.0)
    host.pass_time(0.01)
    assert host.send(0x080) == []
    host.drive.set_supply_v(24.0)
    host.pass_time(0.01)
    assert host.received() == [(0x701, b"\x00")]


def test_a_hot_drive_faults_again_after_each_reset_until_it_has_cooled(host: Host) -> None:
    host.enable()
    host.drive.overheat()
    host.pass_time(0.01)
    assert state(host) is PowerState.FAULT
    host.command(0x80)
    host.pass_time(0.01)
    assert state(host) is PowerState.FAULT
    assert [code for code in emergencies(host) if code] == [0x4310]
    host.drive._stage.temperature_c = 25.0  # how it cools is the power stage's test
    host.command(0x00)
    host.command(0x80)
    host.pass_time(0.01)
    assert state(host) is PowerState.SWITCH_ON_DISABLED


def test_an_overload_trips_after_its_time(host: Host) -> None:
    host.enable(1.0)
    host.drive.overload(True)
    host.pass_time(19.0)
    assert state(host) is PowerState.OPERATION_ENABLED
    host.pass_time(2.0)
    assert state(host) is PowerState.FAULT
    assert 0x2310 in emergencies(host)


def test_a_frozen_drive_repeats_its_values_and_keeps_its_heartbeat(host: Host) -> None:
    host.write(0x1017, 0, 20, 2)
    host.enable(3.0)
    host.pass_time(0.5)
    host.drive.freeze(True)
    first = host.send(0x080)[-2:]
    host.pass_time(0.2)
    assert any(can_id == 0x701 for can_id, _ in host.received())
    assert host.send(0x080)[-2:] == first
    host.drive.freeze(False)
    host.pass_time(0.01)
    assert host.send(0x080)[-2:] != first


def test_a_silent_drive_still_obeys(host: Host) -> None:
    host.enable(3.0)
    host.drive.silence(True)
    assert host.send(0x080) == []
    host.pass_time(0.5)
    assert host.wheel.velocity_rad_s == pytest.approx(3.0, abs=0.05)


def test_a_restarted_controller_reports_its_recovery(host: Host) -> None:
    host.wire.set_bus_off(host.drive)
    host.wire.restart(host.drive)
    host.pass_time(0.01)
    assert emergencies(host) == [0x8140]


@pytest.mark.parametrize(("option", "deceleration"), [(1, 10.0), (2, 20.0), (5, 10.0), (6, 20.0)])
def test_a_quick_stop_option_chooses_its_ramp(host: Host, option: int, deceleration: float) -> None:
    host.write(0x605A, 0, option, 2)
    host.write(0x6084, 0, round(10.0 * COUNTS_PER_RAD), 4)
    host.write(0x6085, 0, round(20.0 * COUNTS_PER_RAD), 4)
    host.enable(6.0)
    host.pass_time(0.8)
    host.command(0x02)
    host.pass_time(0.2)
    assert host.wheel.velocity_rad_s == pytest.approx(6.0 - 0.2 * deceleration, abs=0.2)
