"""Describe frames in words."""

import can
import pytest

from drivers.can.words import Words, describe_canopen, describe_odrive
from drivers.odrive.codec import AxisState, OdriveCommand, can_id, encode


def frame(can_id_: int, data: str = "", *, remote: bool = False) -> can.Message:
    return can.Message(
        arbitration_id=can_id_,
        is_extended_id=False,
        is_remote_frame=remote,
        data=None if remote else bytes.fromhex(data),
    )


@pytest.mark.parametrize(
    ("can_id_", "data", "kind", "node", "text"),
    [
        (0x000, "0100", "NMT", None, "START all nodes"),
        (0x000, "8102", "NMT", None, "RESET_NODE node 2"),
        (0x080, "", "SYNC", None, ""),
        (0x082, "30811100000000 00", "EMCY", 2, "0x8130 heartbeat of the master lost"),
        (0x181, "3706e8030000", "TPDO1", 1, "(operation enabled), velocity 1000 counts/s"),
        (0x201, "0f00e8030000", "RPDO1", 1, "controlword 0x000F, target velocity 1000"),
        (0x281, "e8030000f401", "TPDO2", 1, "position 1000 counts, torque 50 % of rated"),
        (0x601, "2f60600003000000", "SDO request", 1, "write 0x6060:0 = 03 (3)"),
        (0x581, "8060600030000906", "SDO reply", 1, "aborted with 0x06090030, value out of"),
        (0x701, "05", "heartbeat", 1, "OPERATIONAL"),
        (0x701, "", "heartbeat", 1, "malformed: heartbeat has 0 bytes"),
        (0x77F, "05", "heartbeat", 127, "OPERATIONAL"),
        (0x780, "", "unknown", None, ""),
    ],
)
def test_canopen_frames(can_id_: int, data: str, kind: str, node: int | None, text: str) -> None:
    words = describe_canopen(frame(can_id_, data))
    assert (words.kind, words.node) == (kind, node)
    assert text in words.text


@pytest.mark.parametrize(
    ("command", "values", "text"),
    [
        (OdriveCommand.SET_AXIS_STATE, (AxisState.CLOSED_LOOP_CONTROL,), "CLOSED_LOOP_CONTROL"),
        (OdriveCommand.SET_CONTROLLER_MODE, (2, 2), "Control_Mode VELOCITY, Input_Mode VEL_RAMP"),
        (OdriveCommand.SET_INPUT_VEL, (1.5, 0.0), "Input_Vel 1.5, Input_Torque_FF 0"),
        (OdriveCommand.GET_ERROR, (0, 0x100_0000), "Disarm_Reason WATCHDOG_TIMER_EXPIRED"),
        (OdriveCommand.HEARTBEAT, (0, 99, 0, 0), "Axis_State unknown 99"),
        (OdriveCommand.HEARTBEAT, (0, 4, 1, 0), "MOTOR_CALIBRATION, Procedure_Result BUSY"),
        (OdriveCommand.ESTOP, (), ""),
    ],
)
def test_odrive_frames(command: OdriveCommand, values: tuple[float, ...], text: str) -> None:
    words = describe_odrive(frame(can_id(5, command), encode(command, *values).hex()))
    assert words.node == 5
    assert text in words.text


def test_requests_by_remote_frame_and_unknown_commands_are_described() -> None:
    asked = describe_odrive(frame(can_id(5, OdriveCommand.GET_IQ), remote=True))
    assert asked == Words(kind="Get_Iq", node=5, text="asked for by a remote frame")
    assert describe_odrive(frame(can_id(5, OdriveCommand.GET_IQ))).text == (
        "asked for by an empty frame"
    )
    assert describe_odrive(frame(5 << 5 | 0x08)).kind == "command 0x08"
    assert describe_odrive(frame(0x3F << 5 | OdriveCommand.ESTOP)).node is None
