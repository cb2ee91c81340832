"""Drive the wheels over ODrive's CANSimple protocol: own state machine, ramps and watch."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Final

import can
import numpy as np
from numpy.typing import NDArray

from drivers.clock import NS_PER_S, Clock
from drivers.odrive.axis_port import AxisPort
from drivers.odrive.axis_setup import FEEDBACK_MS, LACKS, AxisSetup
from drivers.odrive.codec import AxisState, OdriveCommand, split_id
from drivers.odrive.endpoints import ENCODER_RATE, EndpointTable, read_endpoints
from drivers.odrive.spec import AxisSpec
from drivers.stepping import listening, side_by_side
from drivers.wheel_drives.bus import DriveGoal, DriveState, PowerState, ResetRule
from drivers.wheel_drives.cycle import STILL_RAD_S, DriveCycle

STATE_REQUEST_NS: Final = 50_000_000
POLL_NS: Final = 25_000_000
FRESH_NS: Final = NS_PER_S // 4
LATE_S: Final = 3 * FEEDBACK_MS / 1000
MAX_REV_S: Final = 1e4
_POLLED: Final = (
    OdriveCommand.GET_ERROR,
    OdriveCommand.GET_TORQUES,
    OdriveCommand.GET_TEMPERATURE,
    OdriveCommand.GET_BUS_VOLTAGE_CURRENT,
    OdriveCommand.GET_IQ,
    OdriveCommand.RX_SDO,  # stands for the watchdog
)
_WATCHDOG_ERRORS: Final = 0x100_0000


class ODriveBus(DriveCycle[AxisPort]):
    """Command all ODrive axes of one CAN bus; only `connect` waits.

    Each axis' watchdog is armed and verified while connecting, and again before each enabling: when
    the calls of `cycle` stop for `heartbeat_s`, each axis takes its power off by itself, and its
    wheel coasts.
    """

    def __init__(
        self,
        bus: can.BusABC,
        clock: Clock,
        axes: Sequence[AxisSpec],
        endpoints_path: Path,
        heartbeat_s: float = 0.1,
    ) -> None:
        """Take the bus over.

        Raises:
            ValueError: two axes share a node id.
        """
        limit_ns = round(heartbeat_s * NS_PER_S)
        super().__init__(bus, clock, [AxisPort(spec, limit_ns) for spec in axes])
        self._endpoints_path = endpoints_path
        self._table: EndpointTable | None = None
        self._by_node = {port.spec.node_id: port for port in self._ports}
        self._setups = tuple(
            AxisSetup(self._link.send, clock, port, heartbeat_s) for port in self._ports
        )
        self._fresh_until_ns: int | None = None
        self._requested = DriveGoal.DISABLED
        self._request_ns = 0
        self._poll_ns = 0
        self._polled = 0

    def connecting(self) -> Iterator[None]:
        """Check and configure every axis and arm its watchdog; all end up idle.

        Raises:
            NoReply: an axis does not answer.
            WrongDevice: an axis is not the one declared, or does not take a value.
            DeviceFault: an axis has an error that only repair may end.
            DeviceMissing: there is no endpoint file.
            LinkLost: the bus has gone.
        """
        self._start_over()
        self._fresh_until_ns = None
        self._table = read_endpoints(self._endpoints_path)
        for port in self._ports:
            port.forget()
        runs = [setup.running(self._table) for setup in self._setups]
        yield from listening(side_by_side(runs), self._take_frames)

    @property
    def notes(self) -> tuple[str, ...]:
        """Return what the endpoint file lacks, in words; complete after connecting."""
        known = {} if self._table is None else self._table.endpoints
        return tuple(
            f"no endpoint {name}: {lack}" for name, lack in LACKS.items() if name not in known
        )

    def enable(self) -> None:
        """Begin to power all axes; `enabled` tells when they follow."""
        super().enable()
        for port, setup in zip(self._ports, self._setups, strict=True):
            port.watchdog_confirmed = False
            setup.ask_watchdog()

    def cut_power(self) -> None:
        """Send every axis its emergency stop: it disarms at once and stays so until a reset.

        Raises:
            LinkLost: the bus has gone.
        """
        super().cut_power()
        for setup in self._setups:
            setup.tell(OdriveCommand.ESTOP)

    def reset_fault(self) -> tuple[str, ...]:
        """Clear what errors may be cleared; the axes stay idle.

        Return, in words, which errors no reset may take back.
        """
        refused = super().reset_fault()
        for port, setup in zip(self._ports, self._setups, strict=True):
            if port.fault is not None and port.fault.rule is not ResetRule.NEVER:
                setup.tell(OdriveCommand.CLEAR_ERRORS, 0)
                setup.ask(OdriveCommand.GET_ERROR)
        return refused

    def cycle(self, velocity_rad_s: NDArray[np.float64] | None) -> DriveState:
        """Read what has arrived, send setpoints, which feed the watchdogs, and return the state.

        Velocities are the joints', in the order of the specs; None, or axes that are not all
        enabled, sends zero.

        Raises:
            LinkLost: the bus has gone.
            ValueError: a velocity is not finite.
        """
        self._forgive_the_wait()
        return super().cycle(velocity_rad_s)

    def _forgive_the_wait(self) -> None:
        """Clear what watchdogs made of the time from connecting to the first cycle.

        Nothing could move then, since no axis has been enabled yet.
        """
        now_ns = self._clock.now_ns()
        if self._fresh_until_ns is None:
            self._take_frames()
            self._fresh_until_ns = now_ns + FRESH_NS
            for port, setup in zip(self._ports, self._setups, strict=True):
                port.ignored_errors = _WATCHDOG_ERRORS
                setup.clear_silence()
        elif now_ns > self._fresh_until_ns:
            for port in self._ports:
                port.ignored_errors = 0

    def _hear(self, can_id: int, data: bytes, now_ns: int) -> bool:
        node_id, command = split_id(can_id)
        port = self._by_node.get(node_id)
        if port is None:
            return False
        port.take(command, data, now_ns)
        return True

    def _missing(self, now_ns: int) -> list[int]:
        return [row for row, port in enumerate(self._ports) if port.age_s(now_ns) > LATE_S]

    def _send(self, velocity_rad_s: NDArray[np.float64] | None, now_ns: int) -> None:
        for row, (port, setup) in enumerate(zip(self._ports, self._setups, strict=True)):
            target = 0.0
            if velocity_rad_s is not None:
                target = float(velocity_rad_s[row]) * port.spec.revs_per_rad
            setup.tell(OdriveCommand.SET_INPUT_VEL, min(max(target, -MAX_REV_S), MAX_REV_S), 0.0)
        self._request_states(now_ns)
        self._poll(now_ns)

    def _request_states(self, now_ns: int) -> None:
        """Ask each axis for the state it should be in: a new one at once, then now and then."""
        goal = self._goals.goal
        if goal is self._requested and now_ns < self._request_ns:
            return
        self._requested, self._request_ns = goal, now_ns + STATE_REQUEST_NS
        for port, setup in zip(self._ports, self._setups, strict=True):
            wanted = self._wanted_state(port, goal)
            if wanted is not None and port.axis_state is not wanted:
                setup.tell(OdriveCommand.SET_AXIS_STATE, wanted)

    def _wanted_state(self, port: AxisPort, goal: DriveGoal) -> AxisState | None:
        if goal is DriveGoal.ENABLED:
            return AxisState.CLOSED_LOOP_CONTROL if port.watchdog_confirmed else None
        braking = goal is DriveGoal.QUICK_STOP and abs(port.velocity_rad_s) >= STILL_RAD_S
        return None if braking else AxisState.IDLE

    def _poll(self, now_ns: int) -> None:
        """Ask for what the axes do not send by themselves."""
        if self._table is None or ENCODER_RATE not in self._table.endpoints:
            for setup in self._setups:
                setup.ask(OdriveCommand.GET_ENCODER_ESTIMATES)
        if now_ns < self._poll_ns:
            return
        self._poll_ns = now_ns + POLL_NS
        command = _POLLED[self._polled]
        for setup in self._setups:
            setup.ask_watchdog() if command is OdriveCommand.RX_SDO else setup.ask(command)
        self._polled = (self._polled + 1) % len(_POLLED)

    def _power_state(self, port: AxisPort) -> PowerState:
        state = port.power_state
        braking = self._goals.goal is DriveGoal.QUICK_STOP and state is PowerState.OPERATION_ENABLED
        return PowerState.QUICK_STOP_ACTIVE if braking else state

    def _farewell(self) -> None:
        """Take the power off; where a frame is lost, the watchdog is not fed any more."""
        for setup in self._setups:
            setup.tell(OdriveCommand.SET_INPUT_VEL, 0.0, 0.0)
            setup.tell(OdriveCommand.SET_AXIS_STATE, AxisState.IDLE)
