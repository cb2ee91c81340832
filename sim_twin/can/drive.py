"""Emulate one CiA 402 wheel drive as a CANopen node: NMT, heartbeats, SDO, PDO, EMCY."""

from collections.abc import Callable
from typing import Final

import can

from drivers.canopen.cia402 import PowerState
from drivers.canopen.objects import (
    CONTROLWORD,
    EMERGENCY_COB,
    EMERGENCY_WIRE,
    ERROR_CODE,
    ERROR_FIELD,
    ERROR_REGISTER,
    FUNCTION_CODE_MASK,
    HEARTBEAT_COB,
    NMT_COB,
    RPDO1,
    SDO_REPLY_COB,
    SDO_REQUEST_COB,
    SYNC_COB,
    TARGET_VELOCITY,
    TPDO1,
    TPDO2,
    NmtCommand,
    NmtState,
)
from drivers.clock import NS_PER_S
from sim_twin.can.heartbeat import HeartbeatConsumer, HeartbeatProducer
from sim_twin.can.motor import Motor
from sim_twin.can.object_dictionary import VALUE_RANGE, ObjectDictionary, SdoAbort
from sim_twin.can.sdo_server import SdoServer
from sim_twin.can.velocity_loop import VelocityLoop

HEARTBEAT_LOST: Final = 0x8130
COMMUNICATION_ERROR: Final = 0x11
ERROR_FIELD_LENGTH: Final = 4
MAX_NODE_ID: Final = 127


class WheelDrive:
    """Answer CAN frames at once; physics asks for torque with `advance`.

    `sign` is -1 for a drive mounted so that its positive direction turns the joint backwards.
    The loop is stable where kv · step < 2 · (wheel inertia + armature).
    """

    def __init__(
        self,
        node_id: int,
        *,
        sign: int = 1,
        counts_per_rev: int = 16384,
        kv: float = 8.0,
        ki: float = 20.0,
        torque_limit_nm: float = 4.0,
    ) -> None:
        self.node_id = node_id
        self._sign = sign
        self._objects = ObjectDictionary(node_id)
        loop = VelocityLoop(kv, ki, torque_limit_nm)
        self._motor = Motor(
            self._objects, loop, counts_per_rev=counts_per_rev, rated_nm=torque_limit_nm
        )
        self._sdo = SdoServer(self._objects)
        self._producer = HeartbeatProducer(self._objects)
        self._consumer = HeartbeatConsumer(self._objects)
        self._objects.on_write[CONTROLWORD, 0] = self._on_controlword
        self._objects.on_write[ERROR_FIELD, 0] = self._clear_history
        # Like a CAN controller's acceptance filter: nothing is done for the frames of others.
        self._heeded = frozenset(
            {
                NMT_COB,
                SYNC_COB,
                RPDO1.cob_base + node_id,
                SDO_REQUEST_COB + node_id,
                *range(HEARTBEAT_COB, HEARTBEAT_COB + MAX_NODE_ID + 1),
            }
        )
        self._nmt_state = NmtState.BOOT_UP
        self._send_frame: Callable[[can.Message], None] = lambda frame: None
        self._now_ns: int | None = None
        self._supplied = True

    @property
    def power_state(self) -> PowerState:
        """Return the CiA 402 state, for tests and for the referee."""
        return self._motor.state

    @property
    def nmt_state(self) -> NmtState:
        """Return the communication state, for tests."""
        return self._nmt_state

    @property
    def supplied(self) -> bool:
        """Tell whether the drive has power."""
        return self._supplied

    def connect(self, send: Callable[[can.Message], None]) -> None:
        """Remember how to put a frame on the wire, and boot."""
        self._send_frame = send
        self._boot()

    def set_supply(self, on: bool) -> None:
        """Switch the drive's supply: off is silent and without torque, on boots anew."""
        if on and not self._supplied:
            self._supplied = True
            self._objects.reset()
            self._boot()
        elif not on:
            self._supplied = False
            self._motor.lose_supply()

    def raise_fault(self, code: int, error_register: int = 0x01) -> None:
        """Enter the fault reaction and tell the code by EMCY, as a real cause would."""
        self._motor.fail()
        self._report(code, error_register)

    def advance(self, now_ns: int, position_rad: float, velocity_rad_s: float) -> float:
        """Take the joint's state at `now_ns` and return the torque on the joint in N·m."""
        dt_s = 0.0 if self._now_ns is None else (now_ns - self._now_ns) / NS_PER_S
        self._now_ns = now_ns
        if not self._supplied:
            return 0.0
        if self._producer.due(now_ns):
            self._send(HEARTBEAT_COB, bytes((self._nmt_state,)))
        if self._consumer.expired(now_ns):
            self._motor.on_connection_lost()
            self._report(HEARTBEAT_LOST, COMMUNICATION_ERROR)
        sign = self._sign
        return sign * self._motor.advance(dt_s, sign * position_rad, sign * velocity_rad_s)

    def receive(self, frame: can.Message) -> None:
        """Take one frame from the wire."""
        if frame.arbitration_id not in self._heeded:
            return
        ordinary = not (frame.is_extended_id or frame.is_remote_frame or frame.is_error_frame)
        if not (self._supplied and ordinary):
            return
        can_id, data = frame.arbitration_id, bytes(frame.data)
        if can_id == NMT_COB:
            self._on_nmt(data)
        elif can_id == SYNC_COB:
            self._on_sync()
        elif can_id == RPDO1.cob_base + self.node_id:
            self._on_setpoint(data)
        elif can_id == SDO_REQUEST_COB + self.node_id:
            self._on_sdo(data)
        elif can_id & FUNCTION_CODE_MASK == HEARTBEAT_COB:
            self._on_heartbeat(can_id - HEARTBEAT_COB)

    def _on_nmt(self, data: bytes) -> None:
        if len(data) != 2 or data[1] not in (0, self.node_id):
            return
        match data[0]:
            case NmtCommand.START:
                self._enter(NmtState.OPERATIONAL)
            case NmtCommand.PRE_OPERATIONAL:
                self._enter(NmtState.PRE_OPERATIONAL)
            case NmtCommand.STOP:
                self._enter(NmtState.STOPPED)
                self._motor.on_connection_lost()
            case NmtCommand.RESET_NODE:
                self._objects.reset()
                self._boot()
            case NmtCommand.RESET_COMMUNICATION:
                self._motor.on_connection_lost()
                self._objects.reset(communication_only=True)
                self._announce()

    def _boot(self) -> None:
        self._motor.start()
        self._announce()

    def _announce(self) -> None:
        self._consumer.forget()
        self._send(HEARTBEAT_COB, bytes((NmtState.BOOT_UP,)))
        self._enter(NmtState.PRE_OPERATIONAL)

    def _enter(self, state: NmtState) -> None:
        self._nmt_state = state
        self._motor.remote = state is NmtState.OPERATIONAL

    def _on_heartbeat(self, node_id: int) -> None:
        if node_id and node_id == self._consumer.node_id and self._now_ns is not None:
            self._consumer.hear(self._now_ns)

    def _on_sync(self) -> None:
        if self._nmt_state is not NmtState.OPERATIONAL:
            return
        motor = self._motor
        status = TPDO1.wire.pack(motor.statusword(), motor.velocity_counts_s)
        self._send(TPDO1.cob_base, status)
        self._send(TPDO2.cob_base, TPDO2.wire.pack(motor.position_counts, motor.torque_steps))

    def _on_setpoint(self, data: bytes) -> None:
        if self._nmt_state is not NmtState.OPERATIONAL or len(data) != RPDO1.wire.size:
            return
        controlword, target = RPDO1.wire.unpack(data)
        self._objects.set(TARGET_VELOCITY, 0, target)
        self._on_controlword(controlword)

    def _on_controlword(self, controlword: int) -> None:
        if self._motor.on_controlword(controlword):
            self._report(0, 0)

    def _on_sdo(self, data: bytes) -> None:
        if self._nmt_state is NmtState.STOPPED:
            return
        reply = self._sdo.answer(data)
        if reply is not None:
            self._send(SDO_REPLY_COB, reply)

    def _report(self, code: int, error_register: int) -> None:
        """Send an EMCY and keep the code; code 0 says that errors have gone."""
        self._objects.set(ERROR_CODE, 0, code)
        self._objects.set(ERROR_REGISTER, 0, error_register)
        if code:
            self._remember(code)
        if self._nmt_state is not NmtState.STOPPED:
            self._send(EMERGENCY_COB, EMERGENCY_WIRE.pack(code, error_register, bytes(5)))

    def _remember(self, code: int) -> None:
        known = self._objects.get(ERROR_FIELD, 0)
        history = [code] + [self._objects.get(ERROR_FIELD, row + 1) for row in range(known)]
        for row, entry in enumerate(history[:ERROR_FIELD_LENGTH], start=1):
            self._objects.set(ERROR_FIELD, row, entry)
        self._objects.set(ERROR_FIELD, 0, min(len(history), ERROR_FIELD_LENGTH))

    def _clear_history(self, value: int) -> None:
        if value:
            raise SdoAbort(VALUE_RANGE)

    def _send(self, cob_base: int, data: bytes) -> None:
        self._send_frame(
            can.Message(arbitration_id=cob_base + self.node_id, is_extended_id=False, data=data)
        )
