"""Name and pack the messages of ODrive's CANSimple protocol: firmware 0.6, classic 11-bit frames.

A frame's identifier is `node_id << 5 | command`. An axis sends some messages by itself at rates of
its configuration. It sends those of `REQUESTABLE` also in answer to a frame of the same identifier
that is remote or has no data.
"""

import struct
from dataclasses import dataclass
from enum import IntEnum, IntFlag
from typing import Final

from drivers.errors import ProtocolError

COMMAND_BITS: Final = 5
COMMAND_MASK: Final = (1 << COMMAND_BITS) - 1
MAX_NODE_ID: Final = 0x3E
BROADCAST_NODE_ID: Final = 0x3F
MAX_DATA_BYTES: Final = 8


class OdriveCommand(IntEnum):
    """Name the lower five bits of an identifier."""

    GET_VERSION = 0x00
    HEARTBEAT = 0x01
    ESTOP = 0x02
    GET_ERROR = 0x03
    RX_SDO = 0x04
    TX_SDO = 0x05
    ADDRESS = 0x06
    SET_AXIS_STATE = 0x07
    GET_ENCODER_ESTIMATES = 0x09
    SET_CONTROLLER_MODE = 0x0B
    SET_INPUT_POS = 0x0C
    SET_INPUT_VEL = 0x0D
    SET_INPUT_TORQUE = 0x0E
    SET_LIMITS = 0x0F
    SET_TRAJ_VEL_LIMIT = 0x11
    SET_TRAJ_ACCEL_LIMITS = 0x12
    SET_TRAJ_INERTIA = 0x13
    GET_IQ = 0x14
    GET_TEMPERATURE = 0x15
    REBOOT = 0x16
    GET_BUS_VOLTAGE_CURRENT = 0x17
    CLEAR_ERRORS = 0x18
    SET_ABSOLUTE_POSITION = 0x19
    SET_POS_GAIN = 0x1A
    SET_VEL_GAINS = 0x1B
    GET_TORQUES = 0x1C
    GET_POWERS = 0x1D
    ENTER_DFU_MODE = 0x1F


class AxisState(IntEnum):
    """Name the states of an axis, as shown by its heartbeat and asked for by Set_Axis_State."""

    UNDEFINED = 0
    IDLE = 1
    STARTUP_SEQUENCE = 2
    FULL_CALIBRATION_SEQUENCE = 3
    MOTOR_CALIBRATION = 4
    ENCODER_INDEX_SEARCH = 6
    ENCODER_OFFSET_CALIBRATION = 7
    CLOSED_LOOP_CONTROL = 8
    LOCKIN_SPIN = 9
    ENCODER_DIR_FIND = 10
    HOMING = 11
    ENCODER_HALL_POLARITY_CALIBRATION = 12
    ENCODER_HALL_PHASE_CALIBRATION = 13
    ANTICOGGING_CALIBRATION = 14
    HARMONIC_CALIBRATION = 15
    HARMONIC_CALIBRATION_COMMUTATION = 16


class ProcedureResult(IntEnum):
    """Name how the last procedure ended, as shown by the heartbeat (`odrive.enums` 0.6.11)."""

    SUCCESS = 0
    BUSY = 1
    CANCELLED = 2
    DISARMED = 3
    NO_RESPONSE = 4
    POLE_PAIR_CPR_MISMATCH = 5
    PHASE_RESISTANCE_OUT_OF_RANGE = 6
    PHASE_INDUCTANCE_OUT_OF_RANGE = 7
    UNBALANCED_PHASES = 8
    INVALID_MOTOR_TYPE = 9
    ILLEGAL_HALL_STATE = 10
    TIMEOUT = 11
    HOMING_WITHOUT_ENDSTOP = 12
    INVALID_STATE = 13
    NOT_CALIBRATED = 14
    NOT_CONVERGING = 15
    REQUESTED_CURRENT_TOO_HIGH = 16


class ControlMode(IntEnum):
    """Name what the controller regulates."""

    VOLTAGE = 0
    TORQUE = 1
    VELOCITY = 2
    POSITION = 3


class InputMode(IntEnum):
    """Name how an input becomes a setpoint."""

    INACTIVE = 0
    PASSTHROUGH = 1
    VEL_RAMP = 2
    POS_FILTER = 3
    TRAP_TRAJ = 5
    TORQUE_RAMP = 6


class SdoOpcode(IntEnum):
    """Name what RxSdo asks for; the axis answers a READ with TxSdo and a WRITE with nothing."""

    READ = 0
    WRITE = 1


class AxisError(IntFlag):
    """Name the bits of active errors and of the disarm reason."""

    INITIALIZING = 0x1
    SYSTEM_LEVEL = 0x2
    TIMING_ERROR = 0x4
    MISSING_ESTIMATE = 0x8
    BAD_CONFIG = 0x10
    DRV_FAULT = 0x20
    MISSING_INPUT = 0x40
    DC_BUS_OVER_VOLTAGE = 0x100
    DC_BUS_UNDER_VOLTAGE = 0x200
    DC_BUS_OVER_CURRENT = 0x400
    DC_BUS_OVER_REGEN_CURRENT = 0x800
    CURRENT_LIMIT_VIOLATION = 0x1000
    MOTOR_OVER_TEMP = 0x2000
    INVERTER_OVER_TEMP = 0x4000
    VELOCITY_LIMIT_VIOLATION = 0x8000
    POSITION_LIMIT_VIOLATION = 0x1_0000
    WATCHDOG_TIMER_EXPIRED = 0x100_0000
    ESTOP_REQUESTED = 0x200_0000
    SPINOUT_DETECTED = 0x400_0000
    BRAKE_RESISTOR_DISARMED = 0x800_0000
    THERMISTOR_DISCONNECTED = 0x1000_0000
    CALIBRATION_ERROR = 0x4000_0000


@dataclass(frozen=True, slots=True, kw_only=True)
class OdriveMessage:
    """Describe one message: its vendor's name, its packing and its signals in order.

    `least_bytes` are those that a receiver needs; what is left out behind them counts as zero.
    """

    name: str
    wire: struct.Struct
    signals: tuple[str, ...]
    least_bytes: int


def _message(
    name: str, layout: str, *signals: str, least_bytes: int | None = None
) -> OdriveMessage:
    wire = struct.Struct(f"<{layout}")
    least_bytes = wire.size if least_bytes is None else least_bytes
    return OdriveMessage(name=name, wire=wire, signals=signals, least_bytes=least_bytes)


_C = OdriveCommand
# Units: rev, rev/s, N·m, A, V, °C, W. Input_Pos carries its feed-forwards in thousandths.
MESSAGES: Final[dict[OdriveCommand, OdriveMessage]] = {
    _C.GET_VERSION: _message(
        "Get_Version",
        "8B",
        "Protocol_Version",
        "Hw_Version_Major",
        "Hw_Version_Minor",
        "Hw_Version_Variant",
        "Fw_Version_Major",
        "Fw_Version_Minor",
        "Fw_Version_Revision",
        "Fw_Version_Unreleased",
    ),
    # The vendor's DBC file ends it after seven bytes; its ROS node takes no less than eight.
    _C.HEARTBEAT: _message(
        "Heartbeat",
        "IBBBx",
        "Axis_Error",
        "Axis_State",
        "Procedure_Result",
        "Trajectory_Done_Flag",
        least_bytes=7,
    ),
    _C.ESTOP: _message("Estop", ""),
    _C.GET_ERROR: _message("Get_Error", "II", "Active_Errors", "Disarm_Reason"),
    # The vendor's examples end it after the header (read) or after the value's own bytes (write).
    _C.RX_SDO: _message("RxSdo", "BHx4s", "Opcode", "Endpoint_ID", "Value", least_bytes=4),
    _C.TX_SDO: _message("TxSdo", "xHx4s", "Endpoint_ID", "Value"),
    # Hosts of firmware before 0.6.11 send no connection id.
    _C.ADDRESS: _message(
        "Address", "B6sB", "Node_ID", "Serial_Number", "Connection_ID", least_bytes=7
    ),
    _C.SET_AXIS_STATE: _message("Set_Axis_State", "I", "Axis_Requested_State"),
    _C.GET_ENCODER_ESTIMATES: _message(
        "Get_Encoder_Estimates", "ff", "Pos_Estimate", "Vel_Estimate"
    ),
    _C.SET_CONTROLLER_MODE: _message("Set_Controller_Mode", "II", "Control_Mode", "Input_Mode"),
    _C.SET_INPUT_POS: _message("Set_Input_Pos", "fhh", "Input_Pos", "Vel_FF", "Torque_FF"),
    _C.SET_INPUT_VEL: _message("Set_Input_Vel", "ff", "Input_Vel", "Input_Torque_FF"),
    _C.SET_INPUT_TORQUE: _message("Set_Input_Torque", "f", "Input_Torque"),
    _C.SET_LIMITS: _message("Set_Limits", "ff", "Velocity_Limit", "Current_Limit"),
    _C.SET_TRAJ_VEL_LIMIT: _message("Set_Traj_Vel_Limit", "f", "Traj_Vel_Limit"),
    _C.SET_TRAJ_ACCEL_LIMITS: _message(
        "Set_Traj_Accel_Limits", "ff", "Traj_Accel_Limit", "Traj_Decel_Limit"
    ),
    _C.SET_TRAJ_INERTIA: _message("Set_Traj_Inertia", "f", "Traj_Inertia"),
    _C.GET_IQ: _message("Get_Iq", "ff", "Iq_Setpoint", "Iq_Measured"),
    _C.GET_TEMPERATURE: _message("Get_Temperature", "ff", "FET_Temperature", "Motor_Temperature"),
    _C.REBOOT: _message("Reboot", "B", "Action"),
    _C.GET_BUS_VOLTAGE_CURRENT: _message(
        "Get_Bus_Voltage_Current", "ff", "Bus_Voltage", "Bus_Current"
    ),
    _C.CLEAR_ERRORS: _message("Clear_Errors", "B", "Identify"),
    _C.SET_ABSOLUTE_POSITION: _message("Set_Absolute_Position", "f", "Position"),
    _C.SET_POS_GAIN: _message("Set_Pos_Gain", "f", "Pos_Gain"),
    _C.SET_VEL_GAINS: _message("Set_Vel_Gains", "ff", "Vel_Gain", "Vel_Integrator_Gain"),
    _C.GET_TORQUES: _message("Get_Torques", "ff", "Torque_Target", "Torque_Estimate"),
    _C.GET_POWERS: _message("Get_Powers", "ff", "Electrical_Power", "Mechanical_Power"),
    _C.ENTER_DFU_MODE: _message("Enter_DFU_Mode", ""),
}

REQUESTABLE: Final = frozenset(
    {
        _C.GET_VERSION,
        _C.HEARTBEAT,
        _C.GET_ERROR,
        _C.ADDRESS,
        _C.GET_ENCODER_ESTIMATES,
        _C.GET_IQ,
        _C.GET_TEMPERATURE,
        _C.GET_BUS_VOLTAGE_CURRENT,
        _C.GET_TORQUES,
        _C.GET_POWERS,
    }
)


def can_id(node_id: int, command: OdriveCommand) -> int:
    """Return the identifier of a command to, or of a message from, an axis."""
    return node_id << COMMAND_BITS | command


def split_id(arbitration_id: int) -> tuple[int, int]:
    """Return node id and command of an identifier."""
    return arbitration_id >> COMMAND_BITS, arbitration_id & COMMAND_MASK


def encode(command: OdriveCommand, *values: float | bytes) -> bytes:
    """Return the data of a message; one value per signal."""
    return MESSAGES[command].wire.pack(*values)


def decode(command: OdriveCommand, data: bytes) -> tuple[int | float | bytes, ...]:
    """Return the signals of a message in the order of its table row.

    A frame may be padded up to eight bytes, as the vendor's DBC file declares most messages.

    Raises:
        ProtocolError: the frame is shorter than it may be or longer than a classic frame.
    """
    message = MESSAGES[command]
    least = message.least_bytes
    if not least <= len(data) <= MAX_DATA_BYTES:
        raise ProtocolError(
            f"{message.name} has {len(data)} bytes, expected {least}..{MAX_DATA_BYTES}"
        )
    return message.wire.unpack_from(data.ljust(message.wire.size, b"\0"))


def is_request(command: OdriveCommand, *, remote: bool, data: bytes) -> bool:
    """Return whether a frame asks the axis for its message."""
    return command in REQUESTABLE and (remote or not data)
