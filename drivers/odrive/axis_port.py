"""Keep what one axis has said: the receiving half of the cycle."""

import math
from collections.abc import Callable
from typing import Final

from drivers.clock import NS_PER_S
from drivers.errors import ProtocolError
from drivers.odrive.codec import AxisState, OdriveCommand, decode
from drivers.odrive.faults import AxisFault
from drivers.odrive.spec import AxisSpec
from drivers.wheel_drives.bus import PowerState

HEARTBEAT_LIMIT_NS: Final = 350_000_000  # three of the axis' heartbeats at their default rate
_POWER_STATES: Final = {
    AxisState.UNDEFINED: PowerState.UNKNOWN,
    AxisState.IDLE: PowerState.SWITCH_ON_DISABLED,
    AxisState.CLOSED_LOOP_CONTROL: PowerState.OPERATION_ENABLED,
}


class AxisPort:
    """Decode the frames of one axis and judge whether it is alive."""

    def __init__(self, spec: AxisSpec, limit_ns: int) -> None:
        self.spec = spec
        self.watchdog_endpoint: int | None = None
        self._limit_ns = limit_ns
        self.forget()

    def forget(self) -> None:
        """Start over, as before the axis' first message."""
        self.axis_state = AxisState.UNDEFINED
        self.errors = 0
        self.disarm_reason = 0
        self.ignored_errors = 0
        self.errors_told = False
        self.firmware = ""
        self.position_rad = 0.0
        self.velocity_rad_s = 0.0
        self.torque_nm = math.nan
        self.fet_temperature_c = math.nan
        self.motor_temperature_c = math.nan
        self.bus_v = math.nan
        self.bus_a = math.nan
        self.iq_a = math.nan
        self.without_estimate = False
        self.heartbeats = 0
        self.values: dict[int, bytes] = {}
        self.watchdog_confirmed = False
        self._gone = False
        self._heartbeat_ns: int | None = None
        self._sample_ns: int | None = None

    @property
    def complete(self) -> bool:
        """Return whether an estimate of position and velocity has arrived."""
        return self._sample_ns is not None

    @property
    def fault(self) -> AxisFault | None:
        """Return what disarmed the axis or keeps it disarmed."""
        code = (self.errors | self.disarm_reason) & ~self.ignored_errors
        return AxisFault(code=code) if code else None

    @property
    def faulted(self) -> bool:
        """Return whether an error disarmed the axis or keeps it disarmed."""
        return self.fault is not None

    @property
    def power_state(self) -> PowerState:
        """Return the axis' state in the words that all drives share."""
        if self.fault is not None:
            return PowerState.FAULT
        return _POWER_STATES.get(self.axis_state, PowerState.NOT_READY)

    def age_s(self, now_ns: int) -> float:
        """Return the age of the latest estimate; infinite before the first."""
        return math.inf if self._sample_ns is None else (now_ns - self._sample_ns) / NS_PER_S

    def lost(self, now_ns: int) -> bool:
        """Return whether the axis fell silent or rebooted; only connecting anew ends that.

        An axis that rebooted has forgotten its watchdog and its limits.
        """
        self._gone = self._gone or self._silent(now_ns)
        return self._gone

    def _silent(self, now_ns: int) -> bool:
        if self._heartbeat_ns is None or self._sample_ns is None:
            return True
        silent = now_ns - self._heartbeat_ns > max(HEARTBEAT_LIMIT_NS, self._limit_ns)
        return silent or now_ns - self._sample_ns > self._limit_ns

    def take(self, command: int, data: bytes, now_ns: int) -> None:
        """Take one frame of the axis; what the host sends itself is passed over.

        Raises:
            ProtocolError: the frame is not what its command says.
        """
        handler = _HANDLERS.get(command)
        if handler is not None:
            handler(self, data, now_ns)

    def _on_heartbeat(self, data: bytes, now_ns: int) -> None:
        errors, state, *_ = decode(OdriveCommand.HEARTBEAT, data)
        try:
            self.axis_state = AxisState(int(state))
        except ValueError as error:
            raise ProtocolError(f"heartbeat of {self.spec.name}: state {state!r}") from error
        self.errors = int(errors)
        self.heartbeats += 1
        self._heartbeat_ns = now_ns

    def _on_error(self, data: bytes, now_ns: int) -> None:
        active, reason = decode(OdriveCommand.GET_ERROR, data)
        self.errors, self.disarm_reason = int(active), int(reason)
        self.errors_told = True

    def _on_estimates(self, data: bytes, now_ns: int) -> None:
        position_rev, velocity_rev_s = map(float, decode(OdriveCommand.GET_ENCODER_ESTIMATES, data))
        self.without_estimate = not (math.isfinite(position_rev) and math.isfinite(velocity_rev_s))
        if self.without_estimate:
            return
        self.position_rad = position_rev / self.spec.revs_per_rad
        self.velocity_rad_s = velocity_rev_s / self.spec.revs_per_rad
        self._sample_ns = now_ns

    def _on_torques(self, data: bytes, now_ns: int) -> None:
        _, motor_nm = map(float, decode(OdriveCommand.GET_TORQUES, data))
        self.torque_nm = self.spec.sign * self.spec.gear_ratio * motor_nm

    def _on_temperature(self, data: bytes, now_ns: int) -> None:
        self.fet_temperature_c, self.motor_temperature_c = map(
            float, decode(OdriveCommand.GET_TEMPERATURE, data)
        )

    def _on_supply(self, data: bytes, now_ns: int) -> None:
        self.bus_v, self.bus_a = map(float, decode(OdriveCommand.GET_BUS_VOLTAGE_CURRENT, data))

    def _on_current(self, data: bytes, now_ns: int) -> None:
        _, self.iq_a = map(float, decode(OdriveCommand.GET_IQ, data))

    def _on_version(self, data: bytes, now_ns: int) -> None:
        version = decode(OdriveCommand.GET_VERSION, data)
        self.firmware = ".".join(str(number) for number in version[4:7])

    def _on_value(self, data: bytes, now_ns: int) -> None:
        number, value = decode(OdriveCommand.TX_SDO, data)
        assert isinstance(value, bytes)
        self.values[int(number)] = value
        if number == self.watchdog_endpoint:
            self.watchdog_confirmed = bool(value[0])
            self._gone = self._gone or not self.watchdog_confirmed


_HANDLERS: Final[dict[int, Callable[[AxisPort, bytes, int], None]]] = {
    OdriveCommand.HEARTBEAT: AxisPort._on_heartbeat,
    OdriveCommand.GET_ERROR: AxisPort._on_error,
    OdriveCommand.GET_ENCODER_ESTIMATES: AxisPort._on_estimates,
    OdriveCommand.GET_TORQUES: AxisPort._on_torques,
    OdriveCommand.GET_TEMPERATURE: AxisPort._on_temperature,
    OdriveCommand.GET_BUS_VOLTAGE_CURRENT: AxisPort._on_supply,
    OdriveCommand.GET_IQ: AxisPort._on_current,
    OdriveCommand.GET_VERSION: AxisPort._on_version,
    OdriveCommand.TX_SDO: AxisPort._on_value,
}
