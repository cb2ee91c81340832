import math
from collections.abc import Callable, Iterator
from pathlib import Path

import can
import cantools.database
import pytest
from cantools.database.can import Database
from hypothesis import given
from hypothesis import strategies as st

from drivers.odrive.codec import (
    MESSAGES,
    REQUESTABLE,
    AxisError,
    AxisState,
    ControlMode,
    InputMode,
    OdriveCommand,
    ProcedureResult,
    SdoOpcode,
)
from drivers.odrive.endpoints import (
    EMULATED_ENDPOINTS,
    ENABLE_WATCHDOG,
    RAMP_RATE,
    WATCHDOG_TIMEOUT,
    read_endpoints,
)
from sim_twin.can import MemoryBus, ODriveAxis
from sim_twin.can.free_wheel import FreeWheel, FreeWheelWorld

NODE_ID = 3
ENDPOINTS = read_endpoints(EMULATED_ENDPOINTS).endpoints


@pytest.fixture(scope="module")
def dbc() -> Database:
    path = Path(__file__).with_name("odrive.dbc")
    database = cantools.database.load_file(path)
    assert isinstance(database, Database)
    return database


class Host:
    """Speak to one axis through the DBC file only."""

    def __init__(self, dbc: Database) -> None:
        self.dbc = dbc
        self.axis = ODriveAxis(NODE_ID)
        self.wheel = FreeWheel(self.axis)
        self.world = FreeWheelWorld([self.wheel])
        self.bus = MemoryBus(self.world.wire)
        self.pass_time(0.002)

    def pass_time(self, duration_s: float) -> None:
        self.world.sleep_until(self.world.now_ns() + round(duration_s * 1e9))

    def command(self, name: str, **signals: float) -> None:
        message = self.dbc.get_message_by_name(name)
        data = message.encode(signals) if signals else b""
        self.send(message.frame_id, data)

    def send(self, command: int, data: bytes = b"", *, remote: bool = False) -> None:
        self.bus.send(
            can.Message(
                arbitration_id=NODE_ID << 5 | command,
                is_extended_id=False,
                is_remote_frame=remote,
                data=None if remote else data,
            )
        )

    def received(self, name: str) -> list[dict[str, float]]:
        """Return, decoded, all messages of that name that have come."""
        wanted = self.dbc.get_message_by_name(name)
        frames = [
            frame
            for frame in iter(self.bus.recv, None)
            if frame.arbitration_id == NODE_ID << 5 | wanted.frame_id
        ]
        return [dict(wanted.decode(bytes(frame.data))) for frame in frames]

    def next_data(self) -> bytes:
        """Return the data of the frame that came first."""
        frame = self.bus.recv()
        assert frame is not None
        return bytes(frame.data)

    def request(self, name: str, *, remote: bool = True) -> dict[str, float]:
        self.received(name)
        self.send(self.dbc.get_message_by_name(name).frame_id, remote=remote)
        (answer,) = self.received(name)
        return answer

    def ask_for(self, state: AxisState) -> None:
        self.command("Set_Axis_State", Axis_Requested_State=state)

    def states(self) -> list[tuple[float, float]]:
        """Return the different pairs of state and result that the latest heartbeats showed."""
        shown = [
            (beat["Axis_State"], beat["Procedure_Result"]) for beat in self.received("Heartbeat")
        ]
        return list(dict.fromkeys(shown))

    def write(self, name: str, value: float) -> None:
        endpoint = ENDPOINTS[name]
        head = bytes((SdoOpcode.WRITE,)) + endpoint.number.to_bytes(2, "little") + b"\0"
        self.send(OdriveCommand.RX_SDO, head + endpoint.encode(value))

    def enable(self, velocity_rev_s: float = 0.0) -> None:
        self.command("Set_Axis_State", Axis_Requested_State=AxisState.CLOSED_LOOP_CONTROL)
        self.command("Set_Input_Vel", Input_Vel=velocity_rev_s, Input_Torque_FF=0.0)
        assert self.axis.axis_state is AxisState.CLOSED_LOOP_CONTROL

    @property
    def speed_rev_s(self) -> float:
        return self.wheel.velocity_rad_s / math.tau


@pytest.fixture
def host(dbc: Database) -> Iterator[Host]:
    host = Host(dbc)
    yield host
    host.bus.shutdown()


@pytest.mark.parametrize("command", sorted(REQUESTABLE))
def test_every_message_is_asked_for_by_a_remote_or_an_empty_frame_and_decodes_by_the_dbc(
    host: Host, command: OdriveCommand
) -> None:
    host.enable(1.0)
    host.pass_time(0.3)
    answer = host.request(MESSAGES[command].name)
    assert set(answer) == set(MESSAGES[command].signals)
    assert all(math.isfinite(value) for value in answer.values())
    assert host.request(MESSAGES[command].name, remote=False) == answer


@pytest.mark.parametrize("command", sorted(set(OdriveCommand) - REQUESTABLE))
def test_an_empty_frame_asks_for_nothing_else(host: Host, command: OdriveCommand) -> None:
    host.received("Heartbeat")
    host.send(command)
    answers = {frame.arbitration_id & 0x1F for frame in iter(host.bus.recv, None)}
    assert answers <= ({OdriveCommand.HEARTBEAT} if command == OdriveCommand.ESTOP else set())


def test_a_heartbeat_has_eight_bytes_as_the_vendors_ros_node_asks(host: Host) -> None:
    host.received("Heartbeat")
    host.send(OdriveCommand.HEARTBEAT, remote=True)
    assert len(host.next_data()) == 8


OFFSET, MOTOR = AxisState.ENCODER_OFFSET_CALIBRATION, AxisState.MOTOR_CALIBRATION


@pytest.mark.parametrize(
    ("wanted", "steps", "duration_s"),
    [
        (AxisState.FULL_CALIBRATION_SEQUENCE, (MOTOR, OFFSET), 13.25),
        (MOTOR, (MOTOR,), 4.25),
        (OFFSET, (OFFSET,), 9.0),
    ],
)
def test_a_calibration_shows_its_steps_as_busy_and_ends_idle(
    host: Host, wanted: AxisState, steps: tuple[AxisState, ...], duration_s: float
) -> None:
    host.enable(1.0)
    host.received("Heartbeat")
    host.ask_for(wanted)
    assert host.axis.armed
    host.pass_time(duration_s - 0.1)
    assert host.states() == [(step, ProcedureResult.BUSY) for step in steps]
    assert host.speed_rev_s == pytest.approx(0.0, abs=0.1)
    host.pass_time(0.3)
    assert host.states()[-1] == (AxisState.IDLE, ProcedureResult.SUCCESS)
    host.enable(1.0)


def _fault(host: Host) -> None:
    host.axis.raise_fault(AxisError.DRV_FAULT)


CALIBRATION_ENDS: list[tuple[Callable[[Host], None], AxisState, ProcedureResult]] = [
    (lambda host: host.ask_for(AxisState.IDLE), AxisState.IDLE, ProcedureResult.CANCELLED),
    (lambda host: host.command("Estop"), AxisState.IDLE, ProcedureResult.DISARMED),
    (_fault, AxisState.IDLE, ProcedureResult.DISARMED),
    (lambda host: host.enable(), AxisState.CLOSED_LOOP_CONTROL, ProcedureResult.SUCCESS),
    (lambda host: host.command("Clear_Errors", Identify=0), MOTOR, ProcedureResult.BUSY),
    (lambda host: host.ask_for(AxisState.HOMING), MOTOR, ProcedureResult.BUSY),
]


@pytest.mark.parametrize(("act", "state", "result"), CALIBRATION_ENDS)
def test_a_calibration_is_ended_by_a_new_request_and_by_an_error(
    host: Host, act: Callable[[Host], None], state: AxisState, result: ProcedureResult
) -> None:
    host.ask_for(AxisState.FULL_CALIBRATION_SEQUENCE)
    host.pass_time(1.0)
    act(host)
    host.received("Heartbeat")
    host.pass_time(0.3)
    assert host.states() == [(state, result)]


@pytest.mark.parametrize(
    ("wanted", "result"),
    [
        (AxisState.HOMING, ProcedureResult.HOMING_WITHOUT_ENDSTOP),
        (AxisState.LOCKIN_SPIN, ProcedureResult.INVALID_STATE),
        (99, ProcedureResult.INVALID_STATE),
        (AxisState.STARTUP_SEQUENCE, ProcedureResult.SUCCESS),
    ],
)
def test_what_the_axis_cannot_do_is_a_result(
    host: Host, wanted: AxisState, result: ProcedureResult
) -> None:
    host.ask_for(wanted)
    assert host.states()[-1] == (AxisState.IDLE, result)


def test_an_axis_with_an_error_does_not_calibrate(host: Host) -> None:
    _fault(host)
    host.ask_for(MOTOR)
    assert host.states()[-1] == (AxisState.IDLE, ProcedureResult.DISARMED)


def test_our_message_table_has_the_names_of_the_dbc(dbc: Database) -> None:
    for message in dbc.messages:
        ours = MESSAGES[OdriveCommand(message.frame_id)]
        assert message.name == ours.name
        assert tuple(signal.name for signal in message.signals) == ours.signals


def test_heartbeats_and_estimates_come_at_their_rates(host: Host) -> None:
    host.received("Heartbeat")
    host.pass_time(1.0)
    frames = [frame.arbitration_id & 0x1F for frame in iter(host.bus.recv, None)]
    assert 10 <= frames.count(OdriveCommand.HEARTBEAT) <= 11
    assert 99 <= frames.count(OdriveCommand.GET_ENCODER_ESTIMATES) <= 101


def test_velocity_control_follows_and_reports_position_and_speed(host: Host) -> None:
    host.enable(2.0)
    host.pass_time(1.0)
    assert host.speed_rev_s == pytest.approx(2.0, abs=0.02)
    before = host.request("Get_Encoder_Estimates")
    host.pass_time(0.5)
    after = host.request("Get_Encoder_Estimates")
    assert after["Vel_Estimate"] == pytest.approx(2.0, abs=0.02)
    assert after["Pos_Estimate"] - before["Pos_Estimate"] == pytest.approx(1.0, abs=0.02)
    assert (after["Pos_Estimate"] * 16384).is_integer()


def test_the_velocity_ramp_keeps_to_its_rate(host: Host) -> None:
    host.write(RAMP_RATE, 4.0)
    host.command(
        "Set_Controller_Mode", Control_Mode=ControlMode.VELOCITY, Input_Mode=InputMode.VEL_RAMP
    )
    host.enable(8.0)
    host.pass_time(0.5)
    assert host.speed_rev_s == pytest.approx(2.0, abs=0.2)


def test_position_control_arrives(host: Host) -> None:
    host.command(
        "Set_Controller_Mode", Control_Mode=ControlMode.POSITION, Input_Mode=InputMode.PASSTHROUGH
    )
    host.command("Set_Pos_Gain", Pos_Gain=5.0)
    host.enable()
    host.command("Set_Input_Pos", Input_Pos=0.5, Vel_FF=0.0, Torque_FF=0.0)
    host.pass_time(3.0)
    assert host.request("Get_Encoder_Estimates")["Pos_Estimate"] == pytest.approx(0.5, abs=0.01)


def test_torque_control_gives_the_torque_asked_for(host: Host) -> None:
    host.command(
        "Set_Controller_Mode", Control_Mode=ControlMode.TORQUE, Input_Mode=InputMode.PASSTHROUGH
    )
    host.enable()
    host.command("Set_Input_Torque", Input_Torque=0.5)
    host.pass_time(0.1)
    assert host.request("Get_Torques")["Torque_Estimate"] == pytest.approx(0.5)
    assert host.request("Get_Iq")["Iq_Measured"] == pytest.approx(1.0)


def test_limits_hold(host: Host) -> None:
    host.command("Set_Limits", Velocity_Limit=1.0, Current_Limit=2.0)
    host.enable(5.0)
    host.pass_time(0.01)
    assert host.request("Get_Iq")["Iq_Measured"] == pytest.approx(2.0)
    host.pass_time(2.0)
    assert host.speed_rev_s == pytest.approx(1.0, abs=0.02)


def test_a_wheel_that_is_driven_beyond_its_limit_disarms(host: Host) -> None:
    host.enable(2.0)
    host.pass_time(1.0)
    host.command("Set_Limits", Velocity_Limit=1.0, Current_Limit=8.0)
    host.pass_time(0.01)
    assert host.axis.disarm_reason is AxisError.VELOCITY_LIMIT_VIOLATION


def test_a_mode_that_is_not_emulated_refuses_to_arm(host: Host) -> None:
    host.command(
        "Set_Controller_Mode", Control_Mode=ControlMode.POSITION, Input_Mode=InputMode.TRAP_TRAJ
    )
    host.command("Set_Axis_State", Axis_Requested_State=AxisState.CLOSED_LOOP_CONTROL)
    assert host.axis.axis_state is AxisState.IDLE
    assert host.request("Get_Error")["Active_Errors"] == AxisError.BAD_CONFIG


def test_the_watchdog_is_off_until_it_is_configured(host: Host) -> None:
    host.enable(1.0)
    host.pass_time(2.0)
    assert host.axis.axis_state is AxisState.CLOSED_LOOP_CONTROL


def test_any_message_feeds_the_watchdog_and_silence_trips_it(host: Host) -> None:
    host.write(WATCHDOG_TIMEOUT, 0.1)
    host.write(ENABLE_WATCHDOG, True)
    host.enable(1.0)
    for _ in range(5):
        host.pass_time(0.08)
        host.send(OdriveCommand.GET_IQ, remote=True)
    assert host.axis.axis_state is AxisState.CLOSED_LOOP_CONTROL
    host.pass_time(0.11)
    error = host.request("Get_Error")
    assert error["Active_Errors"] == error["Disarm_Reason"] == AxisError.WATCHDOG_TIMER_EXPIRED
    assert host.request("Heartbeat")["Axis_State"] == AxisState.IDLE


def test_an_estop_disarms_and_only_clearing_lets_it_arm_again(host: Host) -> None:
    host.enable(1.0)
    host.command("Estop")
    assert host.request("Heartbeat")["Axis_Error"] == AxisError.ESTOP_REQUESTED
    host.command("Set_Axis_State", Axis_Requested_State=AxisState.CLOSED_LOOP_CONTROL)
    assert host.axis.axis_state is AxisState.IDLE
    host.command("Clear_Errors", Identify=0)
    assert host.request("Get_Error") == {"Active_Errors": 0, "Disarm_Reason": 0}
    host.enable(1.0)


def test_a_reboot_disarms_and_forgets_what_was_not_saved(host: Host) -> None:
    host.write(WATCHDOG_TIMEOUT, 3.0)
    host.command("Reboot", Action=1)
    host.write(WATCHDOG_TIMEOUT, 9.0)
    host.enable(1.0)
    host.command("Reboot", Action=0)
    assert host.axis.axis_state is AxisState.IDLE
    number = ENDPOINTS[WATCHDOG_TIMEOUT].number.to_bytes(2, "little")
    host.send(OdriveCommand.RX_SDO, b"\0" + number + bytes(5))
    (answer,) = [
        bytes(frame.data)
        for frame in iter(host.bus.recv, None)
        if frame.arbitration_id == NODE_ID << 5 | OdriveCommand.TX_SDO
    ]
    assert ENDPOINTS[WATCHDOG_TIMEOUT].decode(answer[4:]) == 3.0


def test_properties_are_reached_by_frames_without_padding_as_the_vendors_examples_send(
    host: Host,
) -> None:
    number = ENDPOINTS[ENABLE_WATCHDOG].number.to_bytes(2, "little") + b"\0"
    host.received("Heartbeat")
    host.send(OdriveCommand.RX_SDO, b"\1" + number + b"\1")
    host.send(OdriveCommand.RX_SDO, b"\0" + number)
    assert host.next_data() == b"\0" + number + b"\1\0\0\0"


def test_reading_an_unknown_endpoint_stays_unanswered(host: Host) -> None:
    host.received("Heartbeat")
    host.send(OdriveCommand.RX_SDO, b"\0" + (0xFFFF).to_bytes(2, "little") + bytes(5))
    assert host.bus.recv() is None


def test_the_position_can_be_set(host: Host) -> None:
    host.command("Set_Absolute_Position", Position=7.5)
    assert host.request("Get_Encoder_Estimates")["Pos_Estimate"] == 7.5


def test_a_stored_address_is_changed_by_serial_number_only(host: Host) -> None:
    serial = host.request("Address")["Serial_Number"]
    host.command("Address", Node_ID=9, Serial_Number=serial + 1, Connection_ID=0)
    assert host.axis.node_id == NODE_ID
    host.command("Address", Node_ID=9, Serial_Number=serial, Connection_ID=0)
    assert host.axis.node_id == 9


def test_an_address_without_connection_id_is_taken(host: Host) -> None:
    serial = int(host.request("Address")["Serial_Number"])
    host.send(OdriveCommand.ADDRESS, b"\x09" + serial.to_bytes(6, "little"))
    assert host.axis.node_id == 9


def test_an_undervoltage_disarms(host: Host) -> None:
    host.enable(1.0)
    host.axis.set_supply_v(12.0)
    host.pass_time(0.01)
    assert host.axis.disarm_reason is AxisError.DC_BUS_UNDER_VOLTAGE
    assert host.request("Get_Bus_Voltage_Current")["Bus_Voltage"] == pytest.approx(12.0)


def test_an_overheated_motor_cannot_be_armed_before_it_has_cooled(host: Host) -> None:
    host.axis.overheat()
    host.pass_time(0.01)
    host.command("Clear_Errors", Identify=0)
    host.pass_time(0.01)
    assert host.request("Get_Error")["Active_Errors"] == AxisError.MOTOR_OVER_TEMP
    host.axis._stage.temperature_c = 25.0  # how it cools is the power stage's test
    host.command("Clear_Errors", Identify=0)
    host.enable()


def test_frozen_values_stand_while_the_wheel_turns(host: Host) -> None:
    host.enable(1.0)
    host.pass_time(0.5)
    host.axis.freeze(True)
    first = host.request("Get_Encoder_Estimates")
    host.pass_time(0.5)
    assert host.request("Get_Encoder_Estimates") == first
    assert host.request("Heartbeat")["Axis_State"] == AxisState.CLOSED_LOOP_CONTROL


def test_silence_hides_everything_but_stops_nothing(host: Host) -> None:
    host.enable(1.0)
    host.axis.silence(True)
    host.received("Heartbeat")
    host.pass_time(0.5)
    assert host.bus.recv() is None
    assert host.speed_rev_s > 0.9


@given(
    frames=st.lists(
        st.tuples(st.integers(0, 0x1F), st.booleans(), st.binary(max_size=8)), max_size=40
    )
)
def test_no_sequence_of_frames_breaks_the_axis(
    dbc: Database, frames: list[tuple[int, bool, bytes]]
) -> None:
    host = Host(dbc)
    for command, remote, data in frames:
        host.axis.receive(
            can.Message(
                arbitration_id=host.axis.node_id << 5 | command,
                is_extended_id=False,
                is_remote_frame=remote,
                data=None if remote else data,
            )
        )
        torque_nm = host.axis.advance(host.world.now_ns(), 0.0, 0.0)
        assert abs(torque_nm) <= 4.0
    host.bus.shutdown()
