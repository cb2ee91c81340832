"""Put CAN frames into words: CANopen's and ODrive's, for a person who watches the bus."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import IntEnum
from typing import Final

import can

from drivers.can.errors import describe as describe_error
from drivers.canopen.cia402 import decode_statusword
from drivers.canopen.emergency import decode_emergency
from drivers.canopen.objects import (
    FUNCTION_CODE_MASK,
    RPDO1,
    SYNC_COB,
    TPDO1,
    TPDO2,
    NmtCommand,
    NmtState,
)
from drivers.canopen.sdo_words import describe_sdo_reply, describe_sdo_request
from drivers.errors import ProtocolError
from drivers.odrive.codec import (
    BROADCAST_NODE_ID,
    MESSAGES,
    AxisError,
    AxisState,
    ControlMode,
    InputMode,
    OdriveCommand,
    ProcedureResult,
    decode,
    is_request,
    split_id,
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Words:
    """Say what a frame is, whose it is and what it tells; `node` is None where it is nobody's."""

    kind: str
    node: int | None
    text: str


def _named(kind: type[IntEnum], n: int) -> str:
    return kind(n).name if n in set(kind) else f"unknown {n}"


def _nmt(data: bytes) -> str:
    if len(data) != 2:
        raise ProtocolError(f"NMT command has {len(data)} bytes, expected 2")
    target = f"node {data[1]}" if data[1] else "all nodes"
    return f"{_named(NmtCommand, data[0])} {target}"


def _heartbeat(data: bytes) -> str:
    if len(data) != 1:
        raise ProtocolError(f"heartbeat has {len(data)} bytes, expected 1")
    return _named(NmtState, data[0] & 0x7F)


def _emergency(data: bytes) -> str:
    emergency = decode_emergency(data, 0)
    return f"{emergency.text}, error register 0x{emergency.error_register:02X}"


def _command_pdo(data: bytes) -> str:
    if len(data) != RPDO1.wire.size:
        return ""
    controlword, target = RPDO1.wire.unpack(data)
    return f"controlword 0x{controlword:04X}, target velocity {target} counts/s"


def _status_pdo(data: bytes) -> str:
    if len(data) != TPDO1.wire.size:
        return ""
    statusword, velocity = TPDO1.wire.unpack(data)
    state = decode_statusword(statusword).value
    return f"statusword 0x{statusword:04X} ({state}), velocity {velocity} counts/s"


def _position_pdo(data: bytes) -> str:
    if len(data) != TPDO2.wire.size:
        return ""
    position, torque = TPDO2.wire.unpack(data)
    return f"position {position} counts, torque {torque / 10:g} % of rated"


def _plain(data: bytes) -> str:
    return ""


# Function code: (kind, what its data say); PDOs as this stack maps them.
CANOPEN: Final[Mapping[int, tuple[str, Callable[[bytes], str]]]] = {
    0x000: ("NMT", _nmt),
    0x080: ("EMCY", _emergency),
    0x100: ("TIME", _plain),
    0x180: ("TPDO1", _status_pdo),
    0x200: ("RPDO1", _command_pdo),
    0x280: ("TPDO2", _position_pdo),
    0x300: ("RPDO2", _plain),
    0x380: ("TPDO3", _plain),
    0x400: ("RPDO3", _plain),
    0x480: ("TPDO4", _plain),
    0x500: ("RPDO4", _plain),
    0x580: ("SDO reply", describe_sdo_reply),
    0x600: ("SDO request", describe_sdo_request),
    0x700: ("heartbeat", _heartbeat),
}


def describe_canopen(frame: can.Message) -> Words:
    """Return a CANopen frame in words; one that breaks the protocol says how."""
    outside = _outside_classic(frame)
    if outside is not None:
        return outside
    if frame.arbitration_id == SYNC_COB:
        return Words(kind="SYNC", node=None, text="")
    code, node = frame.arbitration_id & FUNCTION_CODE_MASK, frame.arbitration_id & 0x7F
    if code not in CANOPEN:
        return Words(kind="unknown", node=None, text="")
    kind, tell = CANOPEN[code]
    if frame.is_remote_frame:
        return Words(kind=kind, node=node or None, text="asked for by a remote frame")
    return Words(kind=kind, node=node or None, text=_told(tell, bytes(frame.data)))


def _told(tell: Callable[[bytes], str], data: bytes) -> str:
    try:
        return tell(data)
    except ProtocolError as error:
        return f"malformed: {error}"


def describe_odrive(frame: can.Message) -> Words:
    """Return a CANSimple frame in words; one that breaks the protocol says how."""
    outside = _outside_classic(frame)
    if outside is not None:
        return outside
    node_id, number = split_id(frame.arbitration_id)
    node = None if node_id == BROADCAST_NODE_ID else node_id
    if number not in set(OdriveCommand):
        return Words(kind=f"command 0x{number:02X}", node=node, text="")
    command = OdriveCommand(number)
    data = bytes(frame.data)
    if frame.is_remote_frame:
        text = "asked for by a remote frame"
    elif is_request(command, remote=False, data=data):
        text = "asked for by an empty frame"
    else:
        text = _told(lambda data: _signals(command, data), data)
    return Words(kind=MESSAGES[command].name, node=node, text=text)


def _outside_classic(frame: can.Message) -> Words | None:
    if frame.is_error_frame:
        return Words(kind="error frame", node=None, text=describe_error(frame))
    if frame.is_extended_id or frame.is_fd:
        return Words(kind="foreign", node=None, text="extended or FD frame")
    return None


_SIGNAL_WORDS: Final[Mapping[str, Callable[[int], str]]] = {
    "Axis_State": lambda n: _named(AxisState, n),
    "Axis_Requested_State": lambda n: _named(AxisState, n),
    "Procedure_Result": lambda n: _named(ProcedureResult, n),
    "Control_Mode": lambda n: _named(ControlMode, n),
    "Input_Mode": lambda n: _named(InputMode, n),
    "Axis_Error": lambda n: _errors(n),
    "Active_Errors": lambda n: _errors(n),
    "Disarm_Reason": lambda n: _errors(n),
}


def _errors(bits: int) -> str:
    return str(AxisError(bits).name) if bits else "none"


def _signals(command: OdriveCommand, data: bytes) -> str:
    names = MESSAGES[command].signals
    return ", ".join(
        f"{name} {_value(name, value)}"
        for name, value in zip(names, decode(command, data), strict=True)
    )


def _value(name: str, value: float | bytes) -> str:
    if isinstance(value, bytes):
        return value.hex(" ")
    words = _SIGNAL_WORDS.get(name)
    return f"{value:g}" if words is None else words(int(value))
