"""Find who is on a CAN bus: CANopen nodes and ODrive axes.

Nothing is changed. CANopen nodes are asked by SDO for their identity. An ODrive axis shows itself
by its heartbeat. Where one is heard, nodes that are silent are not asked by SDO: an SDO request to
node 2 would be the emergency stop of axis 48.
"""

from collections.abc import Generator, Iterator
from dataclasses import dataclass, field
from typing import Final

from drivers.can.link import CanLink
from drivers.canopen.objects import (
    DEVICE_TYPE,
    FUNCTION_CODE_MASK,
    HEARTBEAT_COB,
    IDENTITY,
    SDO_REPLY_COB,
    NmtState,
)
from drivers.canopen.sdo import SdoClient
from drivers.clock import NS_PER_S, Clock
from drivers.errors import NoReply, ProtocolError, WrongDevice
from drivers.odrive.codec import (
    MESSAGES,
    AxisError,
    AxisState,
    OdriveCommand,
    can_id,
    decode,
    split_id,
)
from drivers.stepping import side_by_side, until

LISTEN_NS: Final = NS_PER_S // 2
ANSWER_NS: Final = 200_000_000
NODES_AT_ONCE: Final = 8  # a SocketCAN transmit queue holds ten frames
MAX_CANOPEN_NODE: Final = 127
_HEARTBEAT: Final = MESSAGES[OdriveCommand.HEARTBEAT]
_HEARTBEAT_SIZES: Final = (_HEARTBEAT.least_bytes, _HEARTBEAT.wire.size)


@dataclass(slots=True, kw_only=True)
class FoundNode:
    """Hold what a CANopen node told; an object that it does not have stays None."""

    node_id: int
    state: str = "unknown"
    device_type: int | None = None
    vendor: int | None = None
    product: int | None = None
    revision: int | None = None
    serial: int | None = None

    @property
    def profile(self) -> int | None:
        """Return the number of the device profile, 402 for drives."""
        return None if self.device_type is None else self.device_type & 0xFFFF


@dataclass(slots=True, kw_only=True)
class FoundAxis:
    """Hold what an ODrive axis told."""

    node_id: int
    state: str
    errors: str
    firmware: str = "unknown"


@dataclass(slots=True, kw_only=True)
class ScanReport:
    """Hold who was found; `probed` tells whether silent CANopen nodes were asked."""

    nodes: dict[int, FoundNode] = field(default_factory=dict)
    axes: dict[int, FoundAxis] = field(default_factory=dict)
    probed: bool = False


class BusScan:
    """Listen, then ask, step by step."""

    def __init__(self, link: CanLink, clock: Clock, *, canopen: bool, odrive: bool) -> None:
        self.report = ScanReport()
        self._link = link
        self._clock = clock
        self._canopen = canopen
        self._odrive = odrive
        self._clients: dict[int, SdoClient] = {}

    def steps(self) -> Iterator[None]:
        """Fill the report; never wait, but yield where there is nothing to do yet.

        Raises:
            LinkLost: the bus has gone.
        """
        yield from self._listen(LISTEN_NS)
        if self._odrive:
            for node_id in self.report.axes:
                self._link.send(can_id(node_id, OdriveCommand.GET_VERSION), remote=True)
            yield from self._listen(ANSWER_NS if self.report.axes else 0)
        if self._canopen:
            self.report.probed = not self.report.axes
            everyone = range(1, MAX_CANOPEN_NODE + 1)
            asked = everyone if self.report.probed else sorted(self.report.nodes)
            for first in range(0, len(asked), NODES_AT_ONCE):
                yield from self._ask(list(asked[first : first + NODES_AT_ONCE]))

    def _listen(self, duration_ns: int) -> Iterator[None]:
        for _ in until(lambda: False, self._clock, duration_ns):
            self._take()
            yield

    def _ask(self, node_ids: list[int]) -> Iterator[None]:
        for node_id in node_ids:
            self._clients[node_id] = SdoClient(
                self._link.send, node_id, f"node {node_id}", self._clock, ANSWER_NS
            )
        for _ in side_by_side([self._identify(node_id) for node_id in node_ids]):
            yield
            self._take()

    def _identify(self, node_id: int) -> Iterator[None]:
        device_type = yield from self._read(node_id, DEVICE_TYPE, 0)
        if device_type is None and node_id not in self.report.nodes:
            return
        node = self.report.nodes.setdefault(node_id, FoundNode(node_id=node_id))
        node.device_type = device_type
        for name, subindex in (("vendor", 1), ("product", 2), ("revision", 3), ("serial", 4)):
            setattr(node, name, (yield from self._read(node_id, IDENTITY, subindex)))

    def _read(self, node_id: int, index: int, subindex: int) -> Generator[None, None, int | None]:
        try:
            data = yield from self._clients[node_id].upload(index, subindex)
        except (NoReply, WrongDevice, ProtocolError):
            return None
        return int.from_bytes(data, "little")

    def _take(self) -> None:
        for frame in self._link.drain():
            try:
                self._hear(frame.arbitration_id, bytes(frame.data))
            except ProtocolError:
                self._link.frames_malformed += 1

    def _hear(self, arbitration_id: int, data: bytes) -> None:
        code, node_id = arbitration_id & FUNCTION_CODE_MASK, arbitration_id & 0x7F
        if self._canopen and code == HEARTBEAT_COB and len(data) == 1 and node_id:
            node = self.report.nodes.setdefault(node_id, FoundNode(node_id=node_id))
            state = data[0] & 0x7F
            node.state = NmtState(state).name if state in set(NmtState) else f"unknown {state}"
        elif code == SDO_REPLY_COB and node_id in self._clients:
            self._clients[node_id].take_reply(data, self._clock.now_ns())
        elif self._odrive:
            self._hear_axis(*split_id(arbitration_id), data)

    def _hear_axis(self, node_id: int, command: int, data: bytes) -> None:
        if command == OdriveCommand.HEARTBEAT and len(data) in _HEARTBEAT_SIZES:
            errors, state, *_ = decode(OdriveCommand.HEARTBEAT, data)
            if state not in set(AxisState):
                return
            words = str(AxisError(int(errors)).name) if errors else "none"
            axis = FoundAxis(node_id=node_id, state=AxisState(int(state)).name, errors=words)
            known = self.report.axes.get(node_id)
            axis.firmware = axis.firmware if known is None else known.firmware
            self.report.axes[node_id] = axis
        elif command == OdriveCommand.GET_VERSION and node_id in self.report.axes:
            version = decode(OdriveCommand.GET_VERSION, data)
            self.report.axes[node_id].firmware = ".".join(map(str, version[4:7]))
