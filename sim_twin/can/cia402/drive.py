"""Emulate one CiA 402 wheel drive as a CANopen node: NMT, heartbeats, SDO, PDO, EMCY."""

from pathlib import Path
from typing import Final

import can

from drivers.canopen.objects import (
    CONTROLWORD,
    EDS_PATH,
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
    TPDO1,
    TPDO2,
    NmtCommand,
    NmtState,
)
from drivers.wheel_drives.bus import PowerState
from sim_twin.can.bus.error_frames import is_restart
from sim_twin.can.cia402.axis import Cia402Axis
from sim_twin.can.cia402.heartbeat import HeartbeatConsumer, HeartbeatProducer
from sim_twin.can.cia402.object_dictionary import VALUE_RANGE, Key, ObjectDictionary, SdoAbort
from sim_twin.can.cia402.pdo_server import PdoServer
from sim_twin.can.cia402.sdo_server import SdoServer
from sim_twin.can.cia402.velocity_loop import VelocityLoop
from sim_twin.can.emulated_drive import HUB_MOTOR, EmulatedDrive, MotorMounting
from sim_twin.can.power_stage import Trip

HEARTBEAT_LOST: Final = 0x8130
RECOVERED_FROM_BUS_OFF: Final = 0x8140
COMMUNICATION_ERROR: Final = 0x11
# EMCY code and error register of each cause (CiA 402-2 and CiA 301)
TRIP_CODES: Final = {
    Trip.OVERLOAD: (0x2310, 0x03),
    Trip.OVER_VOLTAGE: (0x3210, 0x05),
    Trip.UNDER_VOLTAGE: (0x3220, 0x05),
    Trip.OVER_TEMPERATURE: (0x4310, 0x09),
}
ERROR_FIELD_LENGTH: Final = 4
MAX_NODE_ID: Final = 127


class WheelDrive(EmulatedDrive):
    """Answer CAN frames at once; physics asks for torque with `advance`.

    It shows the objects, types, ranges and defaults of its EDS file.
    """

    def __init__(
        self, node_id: int, mounting: MotorMounting = HUB_MOTOR, eds_path: Path = EDS_PATH
    ) -> None:
        super().__init__(node_id, mounting)
        self._objects = ObjectDictionary(node_id, eds_path)
        loop = VelocityLoop(*mounting.motor_gains)
        self._axis = Cia402Axis(self._objects, loop, self._stage, self._encoder)
        self._sdo = SdoServer(self._objects)
        self._producer = HeartbeatProducer(self._objects)
        self._consumer = HeartbeatConsumer(self._objects)
        self._objects.on_write[CONTROLWORD, 0] = self._on_controlword
        self._objects.on_write[ERROR_FIELD, 0] = self._clear_history
        self._rpdo = PdoServer(self._objects, RPDO1, transmits=False)
        self._tpdos = [PdoServer(self._objects, pdo, transmits=True) for pdo in (TPDO1, TPDO2)]
        self._rpdo.on_change = self._heed
        self._heed()
        self._setpoint: dict[Key, int] = {}
        self._nmt_state = NmtState.BOOT_UP

    def _heed(self) -> None:
        """Choose the frames to look at, like a CAN controller's acceptance filter."""
        self._setpoint_id = self._rpdo.cob_id
        heartbeats = range(HEARTBEAT_COB, HEARTBEAT_COB + MAX_NODE_ID + 1)
        own = {NMT_COB, SYNC_COB, SDO_REQUEST_COB + self.node_id, self._setpoint_id}
        self._heeded = frozenset(own | set(heartbeats))

    @property
    def power_state(self) -> PowerState:
        """Return the CiA 402 state, for tests and for the referee."""
        return self._axis.state

    @property
    def nmt_state(self) -> NmtState:
        """Return the communication state, for tests."""
        return self._nmt_state

    @property
    def armed(self) -> bool:
        """Return whether the power stage is switched on."""
        return self._axis.armed

    @property
    def faulted(self) -> bool:
        """Return whether the drive is in one of its fault states."""
        return self._axis.faulted

    def set_supply(self, on: bool) -> None:
        """Switch the drive's supply: off is silent and without torque, on boots anew."""
        super().set_supply(on)
        if not on:
            self._axis.lose_supply()

    def set_node_id(self, node_id: int) -> None:
        """Give the drive another address, taken over by a restart."""
        self._objects.readdress(node_id)
        super().set_node_id(node_id)

    def raise_fault(self, code: int, error_register: int = 0x01) -> None:
        """Enter the fault reaction and tell the code by EMCY, as a real cause would."""
        self._axis.fail()
        self._report(code, error_register)

    def _act(self, now_ns: int, dt_s: float, velocity_rad_s: float) -> float:
        if now_ns >= self._producer.next_ns or now_ns > self._consumer.deadline_ns:
            self._beat(now_ns)
        return self._axis.advance(dt_s, velocity_rad_s)

    def _trip(self, cause: Trip) -> None:
        self.raise_fault(*TRIP_CODES[cause])

    def _beat(self, now_ns: int) -> None:
        if self._producer.due(now_ns):
            self._send(HEARTBEAT_COB, bytes((self._nmt_state,)))
        if self._consumer.expired(now_ns):
            self._axis.on_connection_lost()
            self._report(HEARTBEAT_LOST, COMMUNICATION_ERROR)

    def receive(self, frame: can.Message) -> None:
        """Take one frame from the wire."""
        can_id = frame.arbitration_id
        if frame.is_error_frame:
            if is_restart(frame):
                self._report(RECOVERED_FROM_BUS_OFF, COMMUNICATION_ERROR)
            return
        if can_id not in self._heeded or not self._supplied:
            return
        if frame.is_extended_id or frame.is_remote_frame:
            return
        data = bytes(frame.data)
        if can_id == NMT_COB:
            self._on_nmt(data)
        elif can_id == SYNC_COB:
            self._on_sync()
        elif can_id == self._setpoint_id:
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
                self._axis.on_connection_lost()
            case NmtCommand.RESET_NODE:
                self._boot()
            case NmtCommand.RESET_COMMUNICATION:
                self._axis.on_connection_lost()
                self._objects.reset(communication_only=True)
                self._announce()

    def _boot(self) -> None:
        self._objects.reset()
        self._axis.start()
        self._announce()

    def _announce(self) -> None:
        self._consumer.forget()
        self._send(HEARTBEAT_COB, bytes((NmtState.BOOT_UP,)))
        self._enter(NmtState.PRE_OPERATIONAL)

    def _enter(self, state: NmtState) -> None:
        self._nmt_state = state
        self._axis.remote = state is NmtState.OPERATIONAL

    def _on_heartbeat(self, node_id: int) -> None:
        if node_id and node_id == self._consumer.node_id and self._now_ns is not None:
            self._consumer.hear(self._now_ns)

    def _on_sync(self) -> None:
        if self._nmt_state is not NmtState.OPERATIONAL:
            return
        if self._setpoint:
            setpoint, self._setpoint = self._setpoint, {}
            self._follow(setpoint)
        for pdo in self._tpdos:
            if pdo.due_on_sync() and pdo.cob_id is not None:
                self._transmit(pdo.cob_id, pdo.pack())

    def _on_setpoint(self, data: bytes) -> None:
        if self._nmt_state is not NmtState.OPERATIONAL or len(data) != self._rpdo.size:
            return
        setpoint = self._rpdo.unpack(data)
        if self._rpdo.synchronous:
            self._setpoint = setpoint
        else:
            self._follow(setpoint)

    def _follow(self, setpoint: dict[Key, int]) -> None:
        """Take over what came by PDO; what is out of range is left as it was."""
        controlword = setpoint.pop((CONTROLWORD, 0), None)
        for key, value in setpoint.items():
            self._objects.store_if_valid(key, value)
        if controlword is not None:
            self._on_controlword(controlword)

    def _on_controlword(self, controlword: int) -> None:
        if self._axis.on_controlword(controlword):
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
        self._transmit(cob_base + self.node_id, data)
