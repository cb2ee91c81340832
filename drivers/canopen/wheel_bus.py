"""Drive the wheels over CANopen: our own PDO cycle, 402 state machine and heartbeat, both ways."""

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Final

import can
import numpy as np
from numpy.typing import NDArray

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
from drivers.canopen.spec import HOST_NODE_ID, DriveSpec
from drivers.clock import NS_PER_S, Clock
from drivers.errors import NoReply
from drivers.stepping import listening, side_by_side, until
from drivers.wheel_drives.bus import DriveGoal, ResetRule
from drivers.wheel_drives.cycle import DriveCycle

BOOT_TIMEOUT_NS: Final = 5 * NS_PER_S // 2
ANSWER_TIMEOUT_NS: Final = 300_000_000
_INT32_MAX: Final = 2**31 - 1


class WheelDriveBus(DriveCycle[DrivePort]):
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
        heartbeat_ms = round(heartbeat_s * 1000)
        limit_ns = heartbeat_ms * 1_000_000
        super().__init__(bus, clock, [DrivePort(spec, limit_ns) for spec in drives])
        self._beat_ns = limit_ns // HEARTBEATS_PER_LIMIT
        self._next_beat_ns = 0
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

    def connecting(self) -> Iterator[None]:
        """Reset, check and configure every drive and start it; all end up disabled.

        The host's heartbeat, and with it the drives' watch over it, starts with the first `cycle`.

        Raises:
            NoReply: a drive does not boot, answer or send its process data and its heartbeat.
            WrongDevice: a drive is not the one that EDS and robot file declare.
            DeviceFault: a drive has a fault that only repair may end.
            LinkLost: the bus has gone.
        """
        self._start_over()
        for node in self._nodes:
            node.read_dictionary()
        yield from self._side_by_side([refuse_unrepaired(node.sdo) for node in self._nodes])
        for port in self._ports:
            port.forget()
        self._order(NmtCommand.RESET_NODE)
        yield from self._await("boots", lambda port: port.booted, BOOT_TIMEOUT_NS)
        yield from self._side_by_side([node.configuring() for node in self._nodes])
        for port in self._ports:
            port.forget_samples()
        self._order(NmtCommand.START)
        self._sync(self._clock.now_ns())
        yield from self._await(
            "sends process data and heartbeats", lambda port: port.operational, ANSWER_TIMEOUT_NS
        )
        if any(port.faulted and port.reset_rule is ResetRule.AUTOMATIC for port in self._ports):
            self._goals.reset_fault(self._clock.now_ns())

    def _side_by_side(self, runs: Sequence[Iterator[None]]) -> Iterator[None]:
        return listening(side_by_side(runs), self._take_frames)

    def _order(self, command: NmtCommand) -> None:
        for port in self._ports:
            self._link.send(NMT_COB, bytes((command, port.spec.node_id)))

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
    def notes(self) -> tuple[str, ...]:
        """Return what the drives cannot do, in words; complete after connecting."""
        return tuple(note for node in self._nodes for note in node.notes)

    def _hear(self, can_id: int, data: bytes, now_ns: int) -> bool:
        handler = self._handlers.get(can_id)
        if handler is None:
            return False
        handler(data, now_ns)
        return True

    def _missing(self, now_ns: int) -> list[int]:
        return [row for row, port in enumerate(self._ports) if port.owes_answers]

    def _send(self, velocity_rad_s: NDArray[np.float64] | None, now_ns: int) -> None:
        """Send heartbeat, setpoints and SYNC; the state that it asks for is the next cycle's."""
        if now_ns >= self._next_beat_ns:
            self._next_beat_ns = now_ns + self._beat_ns
            self._link.send(HEARTBEAT_COB + HOST_NODE_ID, bytes((NmtState.OPERATIONAL,)))
        self._send_setpoints(velocity_rad_s)
        self._sync(now_ns)

    def _send_setpoints(self, velocity_rad_s: NDArray[np.float64] | None) -> None:
        for row, port in enumerate(self._ports):
            counts_s = (
                0.0
                if velocity_rad_s is None
                else float(velocity_rad_s[row]) * port.spec.counts_per_rad
            )
            target = round(min(max(counts_s, -_INT32_MAX), _INT32_MAX))
            controlword = controlword_for(self._goal_of(port), port.power_state)
            self._link.send(
                RPDO1.cob_base + port.spec.node_id, RPDO1.wire.pack(controlword, target)
            )

    def _goal_of(self, port: DrivePort) -> DriveGoal:
        goal = self._goals.goal
        barred = goal is DriveGoal.FAULT_RESET and port.reset_rule is ResetRule.NEVER
        return DriveGoal.DISABLED if barred else goal

    def _sync(self, now_ns: int) -> None:
        for port in self._ports:
            port.expect_answers(now_ns)
        self._link.send(SYNC_COB)

    def _farewell(self) -> None:
        """Brake the drives, which then power off by themselves."""
        self.quick_stop()
        self._send_setpoints(None)
