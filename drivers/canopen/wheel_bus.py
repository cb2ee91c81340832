"""Drive the wheels over CANopen: our own PDO cycle, 402 state machine and heartbeat, both ways."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Final

import can
import canopen
import numpy as np
from numpy.typing import NDArray

from drivers.canopen.cia402 import Goal, PowerState, controlword_for
from drivers.canopen.configure import HEARTBEATS_PER_LIMIT, configure_drive, verify_drive
from drivers.canopen.drive_port import DrivePort
from drivers.canopen.network import CanNetwork, PumpedSdoClient
from drivers.canopen.objects import (
    EDS_PATH,
    EMERGENCY_COB,
    HEARTBEAT_COB,
    NMT_COB,
    RPDO1,
    SYNC_COB,
    TPDO1,
    TPDO2,
    NmtCommand,
    NmtState,
)
from drivers.canopen.spec import DriveSpec, DriveState
from drivers.clock import NS_PER_S, Clock
from drivers.errors import LinkLost, NoReply, ProtocolError

HOST_NODE_ID: Final = 0x7F
BOOT_TIMEOUT_NS: Final = 3 * NS_PER_S
ANSWER_TIMEOUT_NS: Final = 300_000_000
FAULT_RESET_NS: Final = 500_000_000
FRAMES_PER_CYCLE: Final = 256  # so that a babbling node cannot hold up the tick
_INT32_MAX: Final = 2**31 - 1


class WheelDriveBus:
    """Command all wheel drives of one CAN bus; `cycle` never waits, `connect` waits boundedly.

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
    ) -> None:
        if len({spec.node_id for spec in drives}) != len(drives):
            raise ValueError(f"two drives share a node id: {[spec.node_id for spec in drives]}")
        self._clock = clock
        self._heartbeat_ms = round(heartbeat_s * 1000)
        limit_ns = self._heartbeat_ms * 1_000_000
        self._beat_ns = limit_ns // HEARTBEATS_PER_LIMIT
        self._next_beat_ns = 0
        self._eds_path = eds_path
        self._network = CanNetwork(bus, clock)
        self._network.on_frame = self._on_frame
        self._ports = tuple(DrivePort(spec, limit_ns) for spec in drives)
        self._handlers = _handlers(self._ports)
        self._goal = Goal.DISABLED
        self._was_enabled = False
        self._reset_until_ns = 0

    def connect(self) -> None:
        """Reset, check and configure every drive and start it; all end up disabled.

        The host's heartbeat, and with it the drives' watch over it, starts with the first `cycle`.

        Raises:
            NoReply: a drive does not boot, answer or send its process data.
            WrongDevice: a drive is not the one that EDS and robot file declare.
            LinkLost: the bus has gone.
        """
        self._goal = Goal.DISABLED
        self._was_enabled = False
        for port in self._ports:
            port.forget()
            self._network.send_message(NMT_COB, bytes((NmtCommand.RESET_NODE, port.spec.node_id)))
        self._await("boots", lambda port: port.booted, BOOT_TIMEOUT_NS)
        for port in self._ports:
            self._configure(port)
        for port in self._ports:
            self._network.send_message(NMT_COB, bytes((NmtCommand.START, port.spec.node_id)))
        self._sync(self._clock.now_ns())
        self._await("sends process data", lambda port: port.complete, ANSWER_TIMEOUT_NS)
        for port in self._ports:
            port.nmt_state = NmtState.OPERATIONAL

    def _configure(self, port: DrivePort) -> None:
        node_id = port.spec.node_id
        od = canopen.import_od(str(self._eds_path), node_id)
        client = PumpedSdoClient(self._network, node_id, od)
        try:
            port.rated_torque_nm = verify_drive(client, port.spec)
            configure_drive(
                client, port.spec, host_node_id=HOST_NODE_ID, heartbeat_ms=self._heartbeat_ms
            )
        finally:
            self._network.unsubscribe(client.tx_cobid)

    def _await(self, what: str, done: Callable[[DrivePort], bool], timeout_ns: int) -> None:
        if self._network.wait(lambda: all(map(done, self._ports)), timeout_ns):
            return
        silent = ", ".join(
            f"{port.spec.joint} (node {port.spec.node_id})"
            for port in self._ports
            if not done(port)
        )
        raise NoReply(
            f"{self.channel}: no drive {what} within {timeout_ns / NS_PER_S:g} s: {silent}; "
            "check power, node id, bit rate and bus termination"
        )

    @property
    def channel(self) -> str:
        """Name the bus, for messages."""
        return str(self._network.bus.channel_info)

    @property
    def counters(self) -> dict[str, int]:
        """Return what the bus has carried and lost since it was opened."""
        network = self._network
        return {
            "sent": network.frames_sent,
            "received": network.frames_received,
            "dropped": network.frames_dropped,
            "malformed": network.frames_malformed,
        }

    @property
    def enabled(self) -> bool:
        """Tell whether every drive is in OPERATION ENABLED and meant to be."""
        return self._goal is Goal.ENABLED and self._all_enabled()

    def _all_enabled(self) -> bool:
        return all(port.power_state is PowerState.OPERATION_ENABLED for port in self._ports)

    def enable(self) -> None:
        """Lead all drives to OPERATION ENABLED over the next cycles; the target starts at zero.

        A drive that faults, is lost or falls out of OPERATION ENABLED takes the others with it:
        the goal becomes a quick stop, and only a new call enables again.
        """
        self._goal = Goal.ENABLED
        self._was_enabled = False

    def disable(self) -> None:
        """Take the power off all drives with the next cycle; the wheels coast."""
        self._goal = Goal.DISABLED

    def quick_stop(self) -> None:
        """Brake all drives on their quick stop ramp, then take their power off."""
        self._goal = Goal.QUICK_STOP

    def reset_fault(self) -> None:
        """Ask faulted drives to leave FAULT over the next cycles; all stay disabled."""
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
        now_ns = self._clock.now_ns()
        self._drain()
        self._advance_goal(now_ns)
        if now_ns >= self._next_beat_ns:
            self._next_beat_ns = now_ns + self._beat_ns
            self._network.send_message(HEARTBEAT_COB + HOST_NODE_ID, bytes((NmtState.OPERATIONAL,)))
        self._send_setpoints(velocity_rad_s)
        self._sync(now_ns)
        return self._state(now_ns)

    def _drain(self) -> None:
        for _ in range(FRAMES_PER_CYCLE):
            if not self._network.receive_one(0.0):
                return

    def _on_frame(self, can_id: int, data: bytes) -> None:
        handler = self._handlers.get(can_id)
        if handler is None:
            return
        try:
            handler(data, self._clock.now_ns())
        except ProtocolError:
            self._network.frames_malformed += 1

    def _advance_goal(self, now_ns: int) -> None:
        if self._goal is Goal.ENABLED:
            self._was_enabled = self._was_enabled or self._all_enabled()
            fell_out = self._was_enabled and not self._all_enabled()
            if fell_out or any(port.faulted or port.lost(now_ns) for port in self._ports):
                self._goal = Goal.QUICK_STOP
        elif self._goal is Goal.FAULT_RESET:
            cleared = not any(port.faulted for port in self._ports)
            if cleared or now_ns > self._reset_until_ns:
                self._goal = Goal.DISABLED

    def _send_setpoints(self, velocity_rad_s: NDArray[np.float64] | None) -> None:
        wanted = velocity_rad_s if velocity_rad_s is not None and self.enabled else None
        for row, port in enumerate(self._ports):
            target = 0 if wanted is None else round(float(wanted[row]) * port.spec.counts_per_rad)
            target = min(max(target, -_INT32_MAX), _INT32_MAX)
            controlword = controlword_for(self._goal, port.power_state)
            self._network.send_message(
                RPDO1.cob_base + port.spec.node_id, RPDO1.wire.pack(controlword, target)
            )

    def _sync(self, now_ns: int) -> None:
        for port in self._ports:
            port.expect_answers(now_ns)
        self._network.send_message(SYNC_COB, b"")

    def _state(self, now_ns: int) -> DriveState:
        ports = self._ports
        return DriveState(
            position_rad=np.array([port.position_rad for port in ports]),
            velocity_rad_s=np.array([port.velocity_rad_s for port in ports]),
            torque_nm=np.array([port.torque_nm for port in ports]),
            age_s=np.array([port.age_s(now_ns) for port in ports]),
            power_state=tuple(port.power_state for port in ports),
            lost=tuple(port.lost(now_ns) for port in ports),
            faulted=tuple(port.faulted for port in ports),
            emergency=tuple(port.emergency for port in ports),
            enabled=self.enabled,
        )

    def close(self) -> None:
        """Brake the drives, let them power off by themselves and leave the bus."""
        self._goal = Goal.QUICK_STOP
        try:
            self._send_setpoints(None)
        except LinkLost:
            # Nobody can be told any more: the drives stop for want of our heartbeat.
            self._network.frames_dropped += len(self._ports)
        self._network.bus.shutdown()


def _handlers(ports: Sequence[DrivePort]) -> dict[int, Callable[[bytes, int], None]]:
    handlers: dict[int, Callable[[bytes, int], None]] = {}
    for port in ports:
        node_id = port.spec.node_id
        handlers[TPDO1.cob_base + node_id] = port.on_status
        handlers[TPDO2.cob_base + node_id] = port.on_position
        handlers[HEARTBEAT_COB + node_id] = port.on_heartbeat
        handlers[EMERGENCY_COB + node_id] = port.on_emergency
    return handlers
