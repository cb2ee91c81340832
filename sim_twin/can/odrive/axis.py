"""Emulate one ODrive axis on CANSimple: states, errors, watchdog, cyclic messages, properties."""

import math
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Final

import can

from drivers.clock import NS_PER_S
from drivers.errors import ProtocolError
from drivers.odrive.codec import (
    BROADCAST_NODE_ID,
    AxisError,
    AxisState,
    OdriveCommand,
    ProcedureResult,
    SdoOpcode,
    can_id,
    decode,
    encode,
    is_request,
    split_id,
)
from drivers.odrive.endpoints import (
    EMULATED_ENDPOINTS,
    ENABLE_WATCHDOG,
    ENCODER_RATE,
    HEARTBEAT_RATE,
    RAMP_RATE,
    VELOCITY_LIMIT,
    WATCHDOG_TIMEOUT,
    read_endpoints,
)
from sim_twin.can.emulated_drive import HUB_MOTOR, EmulatedDrive, MotorMounting
from sim_twin.can.odrive.calibration import CALIBRATIONS, AxisCalibration
from sim_twin.can.odrive.controller import ODriveController
from sim_twin.can.odrive.inputs import INPUTS, refuse_nan
from sim_twin.can.odrive.meters import METERS, ODriveMeters
from sim_twin.can.odrive.properties import LiveProperty, ODriveProperties, firmware_numbers
from sim_twin.can.power_stage import Trip

NS_PER_MS: Final = 1_000_000
SERIAL_NUMBER: Final = 0x3946_3153_0000
PROTOCOL_VERSION: Final = 2
EMULATED_BOARD: Final = (0, 0, 0)
UNRELEASED: Final = 1
TRIP_ERRORS: Final = {
    Trip.UNDER_VOLTAGE: AxisError.DC_BUS_UNDER_VOLTAGE,
    Trip.OVER_VOLTAGE: AxisError.DC_BUS_OVER_VOLTAGE,
    Trip.OVER_TEMPERATURE: AxisError.MOTOR_OVER_TEMP,
    Trip.OVERLOAD: AxisError.CURRENT_LIMIT_VIOLATION,
}
RESTART, SAVE_CONFIGURATION, ERASE_CONFIGURATION = range(3)


class ODriveAxis(EmulatedDrive):
    """Answer CAN frames at once; physics asks for torque with `advance`.

    It has the firmware that its endpoint file is of; the one beside the driver is 0.0.0.
    """

    def __init__(
        self,
        node_id: int,
        mounting: MotorMounting = HUB_MOTOR,
        endpoints_path: Path = EMULATED_ENDPOINTS,
    ) -> None:
        """Build the axis as its integrator left it: calibrated, its limit fit for the gear.

        Raises:
            WrongDevice: the endpoint file is none.
            ValueError: its firmware's version is not three numbers.
        """
        super().__init__(node_id, mounting)
        kv, ki = mounting.motor_gains
        self._controller = ODriveController(
            self._stage, kv * math.tau, ki * math.tau, mounting.gear_ratio
        )
        self._meters = ODriveMeters(self._stage, self._encoder, self._controller)
        self._serial = SERIAL_NUMBER + node_id
        table = read_endpoints(endpoints_path)
        numbers = firmware_numbers(table.firmware)
        self._version = (PROTOCOL_VERSION, *EMULATED_BOARD, *numbers, UNRELEASED)
        self.properties = ODriveProperties(table, self._live_properties())
        self._forget()

    def _live_properties(self) -> dict[str, LiveProperty]:
        control = self._controller

        def set_limit(value: float) -> None:
            control.velocity_limit_rev_s = value

        def set_ramp(value: float) -> None:
            control.ramp_rev_s2 = value

        return {
            VELOCITY_LIMIT: LiveProperty(lambda: control.velocity_limit_rev_s, set_limit),
            RAMP_RATE: LiveProperty(lambda: control.ramp_rev_s2, set_ramp),
        }

    def _forget(self) -> None:
        self.properties.load()
        self._controller.reset()
        self._stage.forget_load()
        self._state = AxisState.IDLE
        self._errors = AxisError(0)
        self._disarm_reason = AxisError(0)
        self._procedure_result = ProcedureResult.SUCCESS
        self._calibration: AxisCalibration | None = None
        self._meters.forget()
        self._fed_ns = self._now_ns or 0
        self._due_ns = {HEARTBEAT_RATE: 0, ENCODER_RATE: 0}

    @property
    def axis_state(self) -> AxisState:
        """Return the axis' state, for tests and for the referee."""
        return self._state

    @property
    def errors(self) -> AxisError:
        """Return the active errors."""
        return self._errors

    @property
    def disarm_reason(self) -> AxisError:
        """Return what disarmed the axis last."""
        return self._disarm_reason

    @property
    def armed(self) -> bool:
        """Return whether the power stage is on: in closed loop control and while calibrating."""
        return self._state is not AxisState.IDLE

    @property
    def _regulating(self) -> bool:
        return self._state is AxisState.CLOSED_LOOP_CONTROL

    @property
    def faulted(self) -> bool:
        """Return whether an error is active."""
        return bool(self._errors)

    def raise_fault(self, code: int, error_register: int = 0x01) -> None:
        """Raise `AxisError` bits, as a real cause would; the axis disarms, its wheel coasts."""
        self._errors |= AxisError(code)
        if self.armed:
            self._disarm_reason |= AxisError(code)
            self._rest(ProcedureResult.DISARMED)
        self._tell(OdriveCommand.HEARTBEAT)

    def _trip(self, cause: Trip) -> None:
        self.raise_fault(TRIP_ERRORS[cause])

    def _boot(self) -> None:
        self._forget()
        self._tell(OdriveCommand.HEARTBEAT)

    def _act(self, now_ns: int, dt_s: float, velocity_rad_s: float) -> float:
        self._watch(now_ns)
        self._calibrate(now_ns)
        velocity_rev_s = velocity_rad_s / math.tau
        if self._regulating and self._controller.overspeed(velocity_rev_s):
            self.raise_fault(AxisError.VELOCITY_LIMIT_VIOLATION)
        torque_nm = 0.0
        if self._regulating:
            torque_nm = self._controller.torque_nm(dt_s, self._meters.position_rev, velocity_rev_s)
        self._meters.note_torque(torque_nm)
        self._speak(now_ns)
        return torque_nm

    def _watch(self, now_ns: int) -> None:
        if not self.properties.read(ENABLE_WATCHDOG):
            return
        limit_ns = self.properties.read(WATCHDOG_TIMEOUT) * NS_PER_S
        expired = now_ns - self._fed_ns > limit_ns
        if expired and AxisError.WATCHDOG_TIMER_EXPIRED not in self._errors:
            self.raise_fault(AxisError.WATCHDOG_TIMER_EXPIRED)

    def _calibrate(self, now_ns: int) -> None:
        """Show the step that the calibration has reached; after the last one the axis is idle."""
        if self._calibration is None:
            return
        state = self._calibration.state(now_ns)
        if state is AxisState.IDLE:
            self._rest(ProcedureResult.SUCCESS)
        elif state is self._state:
            return
        self._state = state
        self._tell(OdriveCommand.HEARTBEAT)

    def _rest(self, result: ProcedureResult) -> None:
        self._state = AxisState.IDLE
        self._calibration = None
        self._procedure_result = result

    def _speak(self, now_ns: int) -> None:
        """Send what is due by itself; a rate of 0 ms is off."""
        for name, command in _CYCLIC.items():
            period_ns = int(self.properties.read(name)) * NS_PER_MS
            if period_ns and now_ns >= self._due_ns[name]:
                self._due_ns[name] = max(self._due_ns[name] + period_ns, now_ns)
                self._tell(command)

    def receive(self, frame: can.Message) -> None:
        """Take one frame from the wire; any that is for this axis feeds its watchdog."""
        node_id, number = split_id(frame.arbitration_id)
        strange = frame.is_extended_id or frame.is_error_frame or not self._supplied
        if strange or node_id not in (self.node_id, BROADCAST_NODE_ID):
            return
        if node_id == self.node_id and self._now_ns is not None:
            self._fed_ns = self._now_ns
        try:
            command = OdriveCommand(number)
            data = bytes(frame.data)
            if is_request(command, remote=frame.is_remote_frame, data=data):
                self._tell(command)
            elif not frame.is_remote_frame:
                self._react(command, data)
        except (ValueError, ProtocolError):
            # CANSimple has no way to refuse: what does not fit changes nothing.
            return

    def _react(self, command: OdriveCommand, data: bytes) -> None:
        if command in INPUTS:
            INPUTS[command](self._controller, *decode(command, data))
        elif command in _REACTIONS:
            _REACTIONS[command](self, *decode(command, data))

    def _tell(self, command: OdriveCommand) -> None:
        if command in METERS:
            told: tuple[Any, ...] = METERS[command](self._meters)
        else:
            told = _TOLD[command](self)
        self._transmit(can_id(self.node_id, command), encode(command, *told))

    def _on_axis_state(self, wanted: int) -> None:
        if wanted == AxisState.CLOSED_LOOP_CONTROL:
            self._arm()
        elif wanted in _RESTING:
            cancelled = self._calibration is not None
            self._rest(ProcedureResult.CANCELLED if cancelled else ProcedureResult.SUCCESS)
        elif wanted in CALIBRATIONS:
            self._start_calibration(AxisState(wanted))
        elif self._calibration is None:
            self._procedure_result = _REFUSALS.get(wanted, ProcedureResult.INVALID_STATE)
        self._tell(OdriveCommand.HEARTBEAT)

    def _arm(self) -> None:
        if self._regulating:
            return
        if not self._controller.supported:
            self._errors |= AxisError.BAD_CONFIG
        if self._may_start():
            self._controller.arm(*self._meters.estimates())
            self._state = AxisState.CLOSED_LOOP_CONTROL

    def _start_calibration(self, wanted: AxisState) -> None:
        if self._may_start():
            now_ns = self._now_ns or 0
            self._calibration = AxisCalibration(wanted, now_ns)
            self._state = self._calibration.state(now_ns)
            self._procedure_result = ProcedureResult.BUSY

    def _may_start(self) -> bool:
        """End what the axis does, and tell whether no error keeps it from the next."""
        self._rest(ProcedureResult.DISARMED if self._errors else ProcedureResult.SUCCESS)
        if not self._errors:
            self._disarm_reason = AxisError(0)
        return not self._errors

    def _on_estop(self) -> None:
        self.raise_fault(AxisError.ESTOP_REQUESTED)

    def _on_clear_errors(self, _identify: int) -> None:
        self._errors = self._disarm_reason = AxisError(0)
        if self._calibration is None:
            self._procedure_result = ProcedureResult.SUCCESS

    def _on_reboot(self, action: int) -> None:
        if action == SAVE_CONFIGURATION:
            self.properties.save()
        elif action == ERASE_CONFIGURATION:
            self.properties.erase()
        self._encoder.lose_supply()
        self._boot()

    def _on_position(self, position_rev: float) -> None:
        refuse_nan(position_rev)
        self._meters.call_position(position_rev)
        self._controller.input_rev = position_rev

    def _on_address(self, node_id: int, serial: bytes, _connection: int) -> None:
        if int.from_bytes(serial, "little") == self._serial and node_id < BROADCAST_NODE_ID:
            self.node_id = node_id
            self._tell(OdriveCommand.ADDRESS)

    def _on_sdo(self, opcode: int, number: int, data: bytes) -> None:
        if opcode == SdoOpcode.WRITE:
            self.properties.write_number(number, data)
            return
        told = self.properties.read_number(number) if opcode == SdoOpcode.READ else None
        if told is not None:
            answer = encode(OdriveCommand.TX_SDO, number, told)
            self._transmit(can_id(self.node_id, OdriveCommand.TX_SDO), answer)

    def _heartbeat(self) -> tuple[int, ...]:
        arrived = 1  # velocity and torque inputs have no trajectory to wait for
        return self._errors | self._disarm_reason, self._state, self._procedure_result, arrived


# No start-up flag is set, so the start-up sequence has no step before idle.
_RESTING: Final = frozenset({AxisState.IDLE, AxisState.STARTUP_SEQUENCE})
_REFUSALS: Final[Mapping[int, ProcedureResult]] = {
    AxisState.HOMING: ProcedureResult.HOMING_WITHOUT_ENDSTOP,
}
_CYCLIC: Final = {
    HEARTBEAT_RATE: OdriveCommand.HEARTBEAT,
    ENCODER_RATE: OdriveCommand.GET_ENCODER_ESTIMATES,
}
_REACTIONS: Final[Mapping[OdriveCommand, Callable[..., None]]] = {
    OdriveCommand.ESTOP: ODriveAxis._on_estop,
    OdriveCommand.RX_SDO: ODriveAxis._on_sdo,
    OdriveCommand.ADDRESS: ODriveAxis._on_address,
    OdriveCommand.SET_AXIS_STATE: ODriveAxis._on_axis_state,
    OdriveCommand.REBOOT: ODriveAxis._on_reboot,
    OdriveCommand.CLEAR_ERRORS: ODriveAxis._on_clear_errors,
    OdriveCommand.SET_ABSOLUTE_POSITION: ODriveAxis._on_position,
}
_TOLD: Final[Mapping[OdriveCommand, Callable[[ODriveAxis], tuple[Any, ...]]]] = {
    OdriveCommand.GET_VERSION: lambda axis: axis._version,
    OdriveCommand.HEARTBEAT: ODriveAxis._heartbeat,
    OdriveCommand.GET_ERROR: lambda axis: (axis._errors, axis._disarm_reason),
    OdriveCommand.ADDRESS: lambda axis: (axis.node_id, axis._serial.to_bytes(6, "little"), 0),
}
