"""Drive the wheels over ODrive's CANSimple protocol: own state machine, ramps and watch."""

import operator
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Final

import can
import numpy as np
from numpy.typing import NDArray

from drivers.can_link import CanLink
from drivers.clock import NS_PER_S, Clock
from drivers.drive_bus import (
    DriveState,
    Goal,
    NodeBudget,
    PowerState,
    ResetRule,
    finite,
    listening,
    side_by_side,
    wait_for,
)
from drivers.errors import LinkLost, ProtocolError
from drivers.odrive.axis_port import AxisPort
from drivers.odrive.axis_setup import FEEDBACK_MS, LACKS, AxisSetup
from drivers.odrive.codec import AxisState, Command, split_id
from drivers.odrive.endpoints import ENCODER_RATE, EndpointTable, read_endpoints
from drivers.odrive.spec import AxisSpec

STATE_REQUEST_NS: Final = 50_000_000
POLL_NS: Final = 25_000_000
FAULT_RESET_NS: Final = NS_PER_S // 2
BRAKE_TIMEOUT_NS: Final = 2 * NS_PER_S
FRESH_NS: Final = NS_PER_S // 4
LATE_S: Final = 3 * FEEDBACK_MS / 1000
STILL_RAD_S: Final = 0.05
MAX_REV_S: Final = 1e4
_POLLED: Final = (
    Command.GET_ERROR,
    Command.GET_TORQUES,
    Command.GET_TEMPERATURE,
    Command.GET_BUS_VOLTAGE_CURRENT,
    Command.GET_IQ,
)
_WATCHDOG_ERRORS: Final = 0x100_0000


class ODriveBus:
    """Command all ODrive axes of one CAN bus; only `connect` waits.

    Each axis' watchdog is armed and verified while connecting: when the calls of `cycle` stop for
    `heartbeat_s`, each axis takes its power off by itself, and its wheel coasts.
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
        if len({spec.node_id for spec in axes}) != len(axes):
            raise ValueError(f"two axes share a node id: {[spec.node_id for spec in axes]}")
        self._clock = clock
        self._link = CanLink(bus, clock)
        self._endpoints_path = endpoints_path
        self._table: EndpointTable | None = None
        self._ports = tuple(AxisPort(spec, round(heartbeat_s * NS_PER_S)) for spec in axes)
        self._by_node = {port.spec.node_id: port for port in self._ports}
        self._setups = tuple(
            AxisSetup(self._link.send, clock, port, heartbeat_s) for port in self._ports
        )
        self._budget = NodeBudget([spec.joint for spec in axes])
        self._goal = Goal.DISABLED
        self._was_enabled = False
        self._goal_until_ns = 0
        self._fresh_until_ns: int | None = None
        self._request_ns = 0
        self._poll_ns = 0
        self._polled = 0
        self._closed = False

    def connect(self) -> None:
        """Do all of `connecting`, waiting in between.

        Raises:
            DriverError: as `connecting` does.
        """
        wait_for(self.connecting(), self._clock)

    def connecting(self) -> Iterator[None]:
        """Check and configure every axis and arm its watchdog; all end up idle.

        Raises:
            NoReply: an axis does not answer.
            WrongDevice: an axis is not the one declared, or does not take a value.
            DeviceFault: an axis has an error that only repair may end.
            DeviceMissing: there is no endpoint file.
            LinkLost: the bus has gone.
        """
        self._goal = Goal.DISABLED
        self._was_enabled = False
        self._fresh_until_ns = None
        self._budget.forget()
        self._table = read_endpoints(self._endpoints_path)
        for port in self._ports:
            port.forget()
        runs = [setup.running(self._table) for setup in self._setups]
        yield from listening(side_by_side(runs), self._take_frames)

    @property
    def counters(self) -> dict[str, int]:
        """Return what the bus has carried and lost since it was opened."""
        return self._link.counters | self._budget.counters

    @property
    def notes(self) -> tuple[str, ...]:
        """Return what the endpoint file lacks, in words; complete after connecting."""
        known = {} if self._table is None else self._table.endpoints
        return tuple(
            f"no endpoint {name}: {lack}" for name, lack in LACKS.items() if name not in known
        )

    @property
    def enabled(self) -> bool:
        """Tell whether every axis is in closed loop control and meant to be."""
        return self._goal is Goal.ENABLED and self._all_enabled()

    def _all_enabled(self) -> bool:
        return all(port.power_state is PowerState.OPERATION_ENABLED for port in self._ports)

    def enable(self) -> None:
        """Begin to power all axes; `enabled` tells when they follow."""
        self._goal = Goal.ENABLED
        self._was_enabled = False
        self._request_ns = 0

    def disable(self) -> None:
        """Take the power off all axes; moving wheels coast."""
        self._goal = Goal.DISABLED
        self._request_ns = 0

    def quick_stop(self) -> None:
        """Let all axes brake on their velocity ramp and then take their power off."""
        if self._goal is not Goal.QUICK_STOP:
            self._goal = Goal.QUICK_STOP
            self._goal_until_ns = self._clock.now_ns() + BRAKE_TIMEOUT_NS

    def reset_fault(self) -> tuple[str, ...]:
        """Clear what errors may be cleared; the axes stay idle.

        Return, in words, which errors no reset may take back.
        """
        self._goal = Goal.FAULT_RESET
        self._goal_until_ns = self._clock.now_ns() + FAULT_RESET_NS
        refused = []
        for port, setup in zip(self._ports, self._setups, strict=True):
            fault = port.fault
            if fault is not None and fault.rule is ResetRule.NEVER:
                refused.append(f"{port.spec.name}: {fault.text} is reset {ResetRule.NEVER.value}")
            elif fault is not None:
                setup.tell(Command.CLEAR_ERRORS, 0)
                setup.ask(Command.GET_ERROR)
        return tuple(refused)

    def cycle(self, velocity_rad_s: NDArray[np.float64] | None) -> DriveState:
        """Read what has arrived, send setpoints, which feed the watchdogs, and return the state.

        Velocities are the joints', in the order of the specs; None, or axes that are not all
        enabled, sends zero.

        Raises:
            LinkLost: the bus has gone.
            ValueError: a velocity is not finite.
        """
        wanted = None if velocity_rad_s is None else finite(velocity_rad_s)
        now_ns = self._clock.now_ns()
        self._take_frames()
        late = [row for row, port in enumerate(self._ports) if port.age_s(now_ns) > LATE_S]
        self._budget.note_cycle(late, now_ns)
        self._forgive_the_wait(now_ns)
        self._advance_goal(now_ns)
        self._send_setpoints(wanted)
        self._request_states(now_ns)
        self._poll(now_ns)
        return self._state(now_ns)

    def _take_frames(self) -> bool:
        """Hand out what has arrived and tell whether it was for us."""
        heard = False
        for frame in self._link.drain():
            node_id, command = split_id(frame.arbitration_id)
            port = self._by_node.get(node_id)
            if port is None:
                continue
            try:
                port.take(command, bytes(frame.data), self._clock.now_ns())
                heard = True
            except ProtocolError:
                self._link.frames_malformed += 1
        return heard

    def _forgive_the_wait(self, now_ns: int) -> None:
        """Clear what watchdogs made of the time from connecting to the first cycle.

        Nothing could move then, since no axis has been enabled yet.
        """
        if self._fresh_until_ns is None:
            self._fresh_until_ns = now_ns + FRESH_NS
            for port, setup in zip(self._ports, self._setups, strict=True):
                port.ignored_errors = _WATCHDOG_ERRORS
                setup.clear_silence()
        elif now_ns > self._fresh_until_ns:
            for port in self._ports:
                port.ignored_errors = 0

    def _advance_goal(self, now_ns: int) -> None:
        if self._goal is Goal.ENABLED:
            self._was_enabled = self._was_enabled or self._all_enabled()
            fell_out = self._was_enabled and not self._all_enabled()
            if fell_out or any(self._lost(now_ns)) or any(port.fault for port in self._ports):
                self.quick_stop()
        elif self._goal is Goal.QUICK_STOP:
            if not self._brakes(now_ns) or now_ns > self._goal_until_ns:
                self.disable()
        elif self._goal is Goal.FAULT_RESET:
            cleared = all(port.fault is None for port in self._ports)
            if cleared or now_ns > self._goal_until_ns:
                self.disable()

    def _brakes(self, now_ns: int) -> bool:
        """Tell whether a wheel still has to be braked; one without power or voice cannot be."""
        return any(
            port.power_state is PowerState.OPERATION_ENABLED
            and not port.lost(now_ns)
            and abs(port.velocity_rad_s) >= STILL_RAD_S
            for port in self._ports
        )

    def _send_setpoints(self, velocity_rad_s: NDArray[np.float64] | None) -> None:
        wanted = velocity_rad_s if self.enabled else None
        for row, (port, setup) in enumerate(zip(self._ports, self._setups, strict=True)):
            target = 0.0 if wanted is None else float(wanted[row]) * port.spec.revs_per_rad
            setup.tell(Command.SET_INPUT_VEL, min(max(target, -MAX_REV_S), MAX_REV_S), 0.0)

    def _request_states(self, now_ns: int) -> None:
        """Ask each axis for the state it should be in, at the pace of its heartbeats."""
        if self._goal is Goal.QUICK_STOP or now_ns < self._request_ns:
            return
        self._request_ns = now_ns + STATE_REQUEST_NS
        enabling = self._goal is Goal.ENABLED
        wanted = AxisState.CLOSED_LOOP_CONTROL if enabling else AxisState.IDLE
        for port, setup in zip(self._ports, self._setups, strict=True):
            if port.axis_state is not wanted:
                setup.tell(Command.SET_AXIS_STATE, wanted)

    def _poll(self, now_ns: int) -> None:
        """Ask for what the axes do not send by themselves."""
        if self._table is None or ENCODER_RATE not in self._table.endpoints:
            for setup in self._setups:
                setup.ask(Command.GET_ENCODER_ESTIMATES)
        if now_ns < self._poll_ns:
            return
        self._poll_ns = now_ns + POLL_NS
        for setup in self._setups:
            setup.ask(_POLLED[self._polled])
        self._polled = (self._polled + 1) % len(_POLLED)

    def _lost(self, now_ns: int) -> tuple[bool, ...]:
        silent = (port.lost(now_ns) for port in self._ports)
        return tuple(map(operator.or_, silent, self._budget.lost))

    def _state(self, now_ns: int) -> DriveState:
        ports = self._ports
        return DriveState(
            position_rad=np.array([port.position_rad for port in ports]),
            velocity_rad_s=np.array([port.velocity_rad_s for port in ports]),
            torque_nm=np.array([port.torque_nm for port in ports]),
            age_s=np.array([port.age_s(now_ns) for port in ports]),
            power_state=tuple(self._power_state(port) for port in ports),
            lost=self._lost(now_ns),
            faulted=tuple(port.fault is not None for port in ports),
            fault=tuple(port.fault for port in ports),
            enabled=self.enabled,
        )

    def _power_state(self, port: AxisPort) -> PowerState:
        state = port.power_state
        braking = self._goal is Goal.QUICK_STOP and state is PowerState.OPERATION_ENABLED
        return PowerState.QUICK_STOP_ACTIVE if braking else state

    def close(self) -> None:
        """Take the power off every axis and leave the bus; closing twice is allowed.

        A frame that is lost does not leave a wheel energised: its watchdog is not fed any more.
        """
        if self._closed:
            return
        self._closed = True
        try:
            for setup in self._setups:
                setup.tell(Command.SET_INPUT_VEL, 0.0, 0.0)
                setup.tell(Command.SET_AXIS_STATE, AxisState.IDLE)
        except LinkLost:
            self._link.frames_dropped += len(self._ports)
        self._link.close()
