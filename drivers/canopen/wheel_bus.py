"""Drive the wheels over CANopen: our own PDO cycle, 402 state machine and heartbeat, both ways."""

import operator
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Final

import can
import numpy as np
from numpy.typing import NDArray

from drivers.can_link import CanLink
from drivers.canopen.cia402 import controlword_for
from drivers.canopen.configure import HEARTBEATS_PER_LIMIT, refuse_unrepaired
from drivers.canopen.drive_node import DriveNode
from drivers.canopen.drive_port import DrivePort
from drivers.canopen.objects import (
    EDS_PATH,
    HEARTBEAT_COB,
    NMT_COB,
    RPDO1,
    SYNC_COB,
    NmtCommand,
    NmtState,
)
from drivers.canopen.spec import DriveSpec
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
    until,
    wait_for,
)
from drivers.errors import LinkLost, NoReply, ProtocolError

HOST_NODE_ID: Final = 0x7F
BOOT_TIMEOUT_NS: Final = 5 * NS_PER_S // 2
ANSWER_TIMEOUT_NS: Final = 300_000_000
FAULT_RESET_NS: Final = 500_000_000
_INT32_MAX: Final = 2**31 - 1


class WheelDriveBus:
    """Command all CiA 402 wheel drives of one CAN bus; only `connect` waits.

    The drives demand a heartbeat from this host, which `cycle` sends: when the calls stop for
    `heartbeat_s`, each drive brakes by itself and goes to FAULT.
    """

    def __init__(
        self,
        bus: can.BusABC,
        clock: Clock,
        drives: Sequence[DriveSpec],
        heartbeat_s: float = 0.1,
        eds_path: Path = EDS_PATH,
        cycle_s: float = 0.004,
    ) -> None:
        """Take the bus over.

        Raises:
            ValueError: two drives share a node id.
        """
        if len({spec.node_id for spec in drives}) != len(drives):
            raise ValueError(f"two drives share a node id: {[spec.node_id for spec in drives]}")
        self._clock = clock
        heartbeat_ms = round(heartbeat_s * 1000)
        limit_ns = heartbeat_ms * 1_000_000
        self._beat_ns = limit_ns // HEARTBEATS_PER_LIMIT
        self._next_beat_ns = 0
        self._link = CanLink(bus, clock)
        self._ports = tuple(DrivePort(spec, limit_ns) for spec in drives)
        self._nodes = tuple(
            DriveNode(
                self._link.send,
                clock,
                port,
                eds_path=eds_path,
                host_node_id=HOST_NODE_ID,
                heartbeat_ms=heartbeat_ms,
                cycle_ms=max(1, round(cycle_s * 1000)),
            )
            for port in self._ports
        )
        self._handlers = {key: take for node in self._nodes for key, take in node.handlers()}
        self._budget = NodeBudget([spec.joint for spec in drives])
        self._goal = Goal.DISABLED
        self._was_enabled = False
        self._reset_until_ns = 0
        self._closed = False

    def connect(self) -> None:
        """Do all of `connecting`, waiting in between.

        Raises:
            DriverError: as `connecting` does.
        """
        wait_for(self.connecting(), self._clock)

    def connecting(self) -> Iterator[None]:
        """Reset, check and configure every drive and start it; all end up disabled.

        The host's heartbeat, and with it the drives' watch over it, starts with the first `cycle`.

        Raises:
            NoReply: a drive does not boot, answer or send its process data.
            WrongDevice: a drive is not the one that EDS and robot file declare.
            DeviceFault: a drive has a fault that only repair may end.
            LinkLost: the bus has gone.
        """
        self._goal = Goal.DISABLED
        self._was_enabled = False
        self._budget.forget()
        for node in self._nodes:
            node.read_dictionary()
        yield from listening(
            side_by_side([refuse_unrepaired(node.sdo) for node in self._nodes]), self._take_frames
        )
        for port in self._ports:
            port.forget()
            self._link.send(NMT_COB, bytes((NmtCommand.RESET_NODE, port.spec.node_id)))
        yield from self._await("boots", lambda port: port.booted, BOOT_TIMEOUT_NS)
        yield from listening(
            side_by_side([node.configuring() for node in self._nodes]), self._take_frames
        )
        for port in self._ports:
            self._link.send(NMT_COB, bytes((NmtCommand.START, port.spec.node_id)))
        self._sync(self._clock.now_ns())
        yield from self._await("sends process data", lambda port: port.complete, ANSWER_TIMEOUT_NS)
        for port in self._ports:
            port.nmt_state = NmtState.OPERATIONAL
        if any(port.faulted and port.reset_rule is ResetRule.AUTOMATIC for port in self._ports):
            self._begin_reset()

    def _await(
        self, what: str, done: Callable[[DrivePort], bool], timeout_ns: int
    ) -> Iterator[None]:
        def all_done() -> bool:
            self._take_frames()
            return all(map(done, self._ports))

        yield from until(all_done, self._clock, timeout_ns)
        silent = ", ".join(
            f"{port.spec.joint} (node {port.spec.node_id})"
            for port in self._ports
            if not done(port)
        )
        if silent:
            reason = self._link.trouble or "check power, node id, bit rate and bus termination"
            raise NoReply(
                f"{self.channel}: no drive {what} within {timeout_ns / NS_PER_S:g} s: {silent}; "
                f"{reason}"
            )

    @property
    def channel(self) -> str:
        """Name the bus, for messages."""
        return self._link.name

    @property
    def counters(self) -> dict[str, int]:
        """Return what the bus has carried and lost since it was opened."""
        return self._link.counters | self._budget.counters

    @property
    def notes(self) -> tuple[str, ...]:
        """Return what the drives cannot do, in words; complete after connecting."""
        return tuple(note for node in self._nodes for note in node.notes)

    @property
    def enabled(self) -> bool:
        """Tell whether every drive is in OPERATION ENABLED and meant to be."""
        return self._goal is Goal.ENABLED and self._all_enabled()

    def _all_enabled(self) -> bool:
        return all(port.power_state is PowerState.OPERATION_ENABLED for port in self._ports)

    def enable(self) -> None:
        """Begin to power all drives; `enabled` tells when they follow."""
        self._goal = Goal.ENABLED
        self._was_enabled = False

    def disable(self) -> None:
        """Take the power off all drives; moving wheels coast."""
        self._goal = Goal.DISABLED

    def quick_stop(self) -> None:
        """Let all drives brake on their quick stop ramp and then take their power off."""
        self._goal = Goal.QUICK_STOP

    def reset_fault(self) -> tuple[str, ...]:
        """Ask faulted drives to leave their fault; they stay disabled.

        Return, in words, which faults no reset may take back.
        """
        self._begin_reset()
        return tuple(
            f"{port.spec.name}: {port.emergency.text} is reset {ResetRule.NEVER.value}"
            for port in self._ports
            if port.faulted and port.emergency and port.reset_rule is ResetRule.NEVER
        )

    def _begin_reset(self) -> None:
        self._goal = Goal.FAULT_RESET
        self._reset_until_ns = self._clock.now_ns() + FAULT_RESET_NS

    def cycle(self, velocity_rad_s: NDArray[np.float64] | None) -> DriveState:
        """Read what has arrived, send setpoints and SYNC, and return the drives' state.

        The state is that of the previous SYNC. Velocities are the joints', in the order of the
        specs; None, or drives that are not all enabled, sends zero.

        Raises:
            LinkLost: the bus has gone.
            ValueError: a velocity is not finite.
        """
        wanted = None if velocity_rad_s is None else finite(velocity_rad_s)
        now_ns = self._clock.now_ns()
        self._take_frames()
        owing = [row for row, port in enumerate(self._ports) if port.owes_answers]
        self._budget.note_cycle(owing, now_ns)
        self._advance_goal(now_ns)
        if now_ns >= self._next_beat_ns:
            self._next_beat_ns = now_ns + self._beat_ns
            self._link.send(HEARTBEAT_COB + HOST_NODE_ID, bytes((NmtState.OPERATIONAL,)))
        self._send_setpoints(wanted)
        self._sync(now_ns)
        return self._state(now_ns)

    def _take_frames(self) -> bool:
        """Hand out what has arrived and tell whether it was for us."""
        heard = False
        for frame in self._link.drain():
            handler = self._handlers.get(frame.arbitration_id)
            if handler is None:
                continue
            try:
                handler(bytes(frame.data), self._clock.now_ns())
                heard = True
            except ProtocolError:
                self._link.frames_malformed += 1
        return heard

    def _advance_goal(self, now_ns: int) -> None:
        if self._goal is Goal.ENABLED:
            self._was_enabled = self._was_enabled or self._all_enabled()
            fell_out = self._was_enabled and not self._all_enabled()
            if fell_out or any(self._lost(now_ns)) or any(port.faulted for port in self._ports):
                self._goal = Goal.QUICK_STOP
        elif self._goal is Goal.FAULT_RESET:
            cleared = not any(port.faulted for port in self._ports)
            if cleared or now_ns > self._reset_until_ns:
                self._goal = Goal.DISABLED

    def _goal_of(self, port: DrivePort) -> Goal:
        barred = self._goal is Goal.FAULT_RESET and port.reset_rule is ResetRule.NEVER
        return Goal.DISABLED if barred else self._goal

    def _send_setpoints(self, velocity_rad_s: NDArray[np.float64] | None) -> None:
        wanted = velocity_rad_s if self.enabled else None
        for row, port in enumerate(self._ports):
            target = 0 if wanted is None else round(float(wanted[row]) * port.spec.counts_per_rad)
            target = min(max(target, -_INT32_MAX), _INT32_MAX)
            controlword = controlword_for(self._goal_of(port), port.power_state)
            self._link.send(
                RPDO1.cob_base + port.spec.node_id, RPDO1.wire.pack(controlword, target)
            )

    def _sync(self, now_ns: int) -> None:
        for port in self._ports:
            port.expect_answers(now_ns)
        self._link.send(SYNC_COB)

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
            power_state=tuple(port.power_state for port in ports),
            lost=self._lost(now_ns),
            faulted=tuple(port.faulted for port in ports),
            fault=tuple(port.emergency for port in ports),
            enabled=self.enabled,
        )

    def close(self) -> None:
        """Brake the drives, let them power off by themselves and leave the bus."""
        if self._closed:
            return
        self._closed = True
        self._goal = Goal.QUICK_STOP
        try:
            self._send_setpoints(None)
        except LinkLost:
            # Nobody can be told any more: the drives stop for want of our heartbeat.
            self._link.frames_dropped += len(self._ports)
        self._link.close()
