"""Configure one axis step by step: version, idle, watchdog, limits, velocity mode."""

import struct
from collections.abc import Callable, Generator, Iterator
from typing import Final

from drivers.clock import NS_PER_S, Clock
from drivers.errors import DeviceFault, NoReply, WrongDevice
from drivers.odrive.axis_port import AxisPort
from drivers.odrive.codec import (
    AxisState,
    ControlMode,
    InputMode,
    OdriveCommand,
    SdoOpcode,
    can_id,
    encode,
)
from drivers.odrive.endpoints import (
    ENABLE_WATCHDOG,
    ENCODER_RATE,
    HEARTBEAT_RATE,
    RAMP_RATE,
    VELOCITY_LIMIT,
    WATCHDOG_TIMEOUT,
    Endpoint,
    EndpointTable,
)
from drivers.stepping import until
from drivers.wheel_drives.bus import ResetRule

HEARTBEAT_TIMEOUT_NS: Final = 3 * NS_PER_S // 2
ANSWER_TIMEOUT_NS: Final = 100_000_000
ATTEMPTS: Final = 3
FEEDBACK_MS: Final = 4
HEARTBEAT_MS: Final = 25
REMEDY: Final = "check power, node id, bit rate and bus termination"

LACKS: Final = {
    RAMP_RATE: "wheels brake on the ramp that is stored in the axis",
    ENCODER_RATE: "estimates are asked for in every cycle, which loads the bus",
    HEARTBEAT_RATE: "faults show at the rate that is stored in the axis",
    VELOCITY_LIMIT: "that the velocity limit was taken is not checked",
}


class AxisSetup:
    """Bring one axis from whatever it does to idle, watched and ready to be enabled."""

    def __init__(
        self, send: Callable[..., None], clock: Clock, port: AxisPort, watchdog_s: float
    ) -> None:
        self._send = send
        self._clock = clock
        self._port = port
        self._watchdog_s = watchdog_s

    def tell(self, command: OdriveCommand, *values: float | bytes) -> None:
        """Send one message to the axis; each of them feeds its watchdog."""
        self._send(can_id(self._port.spec.node_id, command), encode(command, *values))

    def ask(self, command: OdriveCommand) -> None:
        """Ask for one message by a remote frame."""
        self._send(can_id(self._port.spec.node_id, command), remote=True)

    def running(self, table: EndpointTable) -> Iterator[None]:
        """Verify and configure the axis.

        Raises:
            NoReply: it is silent.
            WrongDevice: its firmware is not that of the endpoint file, or it takes a value not.
            DeviceFault: it has an error that only repair may end.
        """
        port = self._port
        port.watchdog_endpoint = None
        yield from self._await("heartbeat", lambda: port.heartbeats > 0, HEARTBEAT_TIMEOUT_NS)
        yield from self._check_firmware(table)
        yield from self._refuse_unrepaired()
        yield from self._stand_down()
        for name, value in self._settings():
            if name in table.endpoints:
                yield from self._set(table.endpoints[name], value)
        self._choose_velocity_mode()
        yield from self._clear()
        yield from self._first_estimate()
        port.watchdog_endpoint = table.endpoints[ENABLE_WATCHDOG].number

    def ask_watchdog(self) -> None:
        """Ask whether the watchdog is still armed; an axis that rebooted has forgotten it."""
        self.tell(OdriveCommand.RX_SDO, SdoOpcode.READ, self._port.watchdog_endpoint or 0, bytes(4))

    def _settings(self) -> Iterator[tuple[str, float]]:
        """List the properties to write; the watchdog comes last, for from then on it is fed."""
        spec = self._port.spec
        revs = abs(spec.revs_per_rad)
        yield RAMP_RATE, spec.acceleration_rad_s2 * revs
        yield ENCODER_RATE, FEEDBACK_MS
        yield HEARTBEAT_RATE, HEARTBEAT_MS
        if spec.current_limit_a is not None:
            yield VELOCITY_LIMIT, spec.velocity_limit_rad_s * revs
        yield WATCHDOG_TIMEOUT, self._watchdog_s
        yield ENABLE_WATCHDOG, True

    def _check_firmware(self, table: EndpointTable) -> Iterator[None]:
        port = self._port
        yield from self._obtain("version", OdriveCommand.GET_VERSION, lambda: bool(port.firmware))
        if port.firmware != table.firmware:
            raise WrongDevice(
                f"{port.spec.name}: firmware {port.firmware}, but {table.path} is of "
                f"{table.firmware}; its numbers would reach other properties. Load the file of "
                f"firmware {port.firmware}"
            )

    def _refuse_unrepaired(self) -> Iterator[None]:
        port = self._port
        port.errors_told = False
        yield from self._obtain("errors", OdriveCommand.GET_ERROR, lambda: port.errors_told)
        if port.fault is not None and port.fault.rule is ResetRule.NEVER:
            raise DeviceFault(
                f"{port.spec.name}: {port.fault.text}; it is reset {ResetRule.NEVER.value}"
            )

    def _stand_down(self) -> Iterator[None]:
        port = self._port
        self.tell(OdriveCommand.SET_INPUT_VEL, 0.0, 0.0)
        self.tell(OdriveCommand.SET_AXIS_STATE, AxisState.IDLE)
        yield from self._await(
            "idle state", lambda: port.axis_state is AxisState.IDLE, HEARTBEAT_TIMEOUT_NS
        )

    def _choose_velocity_mode(self) -> None:
        spec = self._port.spec
        self.tell(OdriveCommand.SET_CONTROLLER_MODE, ControlMode.VELOCITY, InputMode.VEL_RAMP)
        if spec.current_limit_a is not None:
            velocity_rev_s = spec.velocity_limit_rad_s * abs(spec.revs_per_rad)
            self.tell(OdriveCommand.SET_LIMITS, velocity_rev_s, spec.current_limit_a)
        self.tell(OdriveCommand.SET_INPUT_VEL, 0.0, 0.0)

    def _clear(self) -> Iterator[None]:
        """Clear what the last host's silence left behind; the rest is the operator's to reset."""
        port = self._port
        self.clear_silence()
        port.errors_told = False
        yield from self._obtain("errors", OdriveCommand.GET_ERROR, lambda: port.errors_told)

    def clear_silence(self) -> None:
        """Clear errors, unless there is one that is not for us to clear."""
        fault = self._port.fault
        if fault is None or fault.rule is ResetRule.AUTOMATIC:
            self.tell(OdriveCommand.CLEAR_ERRORS, 0)

    def _first_estimate(self) -> Iterator[None]:
        port = self._port
        yield from self._obtain(
            "estimate",
            OdriveCommand.GET_ENCODER_ESTIMATES,
            lambda: port.complete or port.without_estimate,
        )
        if not port.complete:
            raise WrongDevice(
                f"{port.spec.name}: has no estimate of its position; calibrate the axis with the "
                "vendor's tool"
            )

    def _set(self, endpoint: Endpoint, value: float) -> Iterator[None]:
        """Write a property and read it back."""
        data = endpoint.encode(value)
        self.tell(OdriveCommand.RX_SDO, SdoOpcode.WRITE, endpoint.number, data)
        got = yield from self._read(endpoint)
        if got[: _significant(endpoint)] != data[: _significant(endpoint)]:
            raise WrongDevice(
                f"{self._port.spec.name}: {endpoint.name} is {endpoint.decode(got):g} after "
                f"{value:g} was written; the axis does not take it"
            )

    def _read(self, endpoint: Endpoint) -> Generator[None, None, bytes]:
        values = self._port.values
        values.pop(endpoint.number, None)
        for _ in range(ATTEMPTS):
            self.tell(OdriveCommand.RX_SDO, SdoOpcode.READ, endpoint.number, bytes(4))
            yield from until(lambda: endpoint.number in values, self._clock, ANSWER_TIMEOUT_NS)
            if endpoint.number in values:
                return values[endpoint.number]
        raise NoReply(
            f"{self._port.spec.name}: does not tell {endpoint.name}; the watchdog cannot be "
            "verified, so the axis is not enabled"
        )

    def _obtain(
        self, what: str, command: OdriveCommand, done: Callable[[], bool]
    ) -> Iterator[None]:
        for _ in range(ATTEMPTS):
            self.ask(command)
            yield from until(done, self._clock, ANSWER_TIMEOUT_NS)
            if done():
                return
        raise NoReply(f"{self._port.spec.name}: no {what} after {ATTEMPTS} requests; {REMEDY}")

    def _await(self, what: str, done: Callable[[], bool], timeout_ns: int) -> Iterator[None]:
        yield from until(done, self._clock, timeout_ns)
        if not done():
            raise NoReply(
                f"{self._port.spec.name}: no {what} within {timeout_ns / NS_PER_S:g} s; {REMEDY}"
            )


def _significant(endpoint: Endpoint) -> int:
    """Return how many of the four bytes carry the value."""
    return len(struct.Struct(endpoint.layout.format.rstrip("x")).pack(0))
