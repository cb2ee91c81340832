"""Configure one drive: its EDS file, its SDO channel and the steps from boot to operational."""

from collections.abc import Callable, Iterator
from pathlib import Path

from drivers.canopen.configure import configure_drive, read_rated_torque, set_mode, verify_drive
from drivers.canopen.drive_port import DrivePort
from drivers.canopen.eds import read_dictionary
from drivers.canopen.objects import (
    EMERGENCY_COB,
    HEARTBEAT_COB,
    RPDO1,
    SDO_REPLY_COB,
    TPDO1,
    TPDO2,
    TPDO2_WITHOUT_TORQUE,
)
from drivers.canopen.parameters import DriveParameters
from drivers.canopen.pdo_setup import lay_out_pdos
from drivers.canopen.requirements import check_dictionary, torque_is_told
from drivers.canopen.sdo import SdoClient, Writing
from drivers.clock import Clock

Handler = Callable[[bytes, int], None]


class DriveNode:
    """Tie a drive's port to its dictionary and its SDO client."""

    def __init__(
        self,
        send: Callable[[int, bytes], None],
        clock: Clock,
        port: DrivePort,
        *,
        eds_path: Path,
        host_node_id: int,
        heartbeat_ms: int,
        cycle_ms: int,
    ) -> None:
        self.port = port
        self.client = SdoClient(send, port.spec.node_id, port.spec.name, clock)
        self.notes: tuple[str, ...] = ()
        self._clock = clock
        self._eds_path = eds_path
        self._host_node_id = host_node_id
        self._heartbeat_ms = heartbeat_ms
        self._cycle_ms = cycle_ms

    def handlers(self) -> Iterator[tuple[int, Handler]]:
        """List the drive's identifiers and who takes their frames."""
        node_id = self.port.spec.node_id
        yield TPDO1.cob_base + node_id, self.port.on_status
        yield TPDO2.cob_base + node_id, self.port.on_position
        yield HEARTBEAT_COB + node_id, self.port.on_heartbeat
        yield EMERGENCY_COB + node_id, self.port.on_emergency
        yield SDO_REPLY_COB + node_id, self.client.take_reply

    def read_dictionary(self) -> None:
        """Read the EDS file and name what the drive lacks.

        Raises:
            DeviceMissing: there is no such file.
            WrongDevice: it is not an EDS file, or lacks what the driver needs.
        """
        spec = self.port.spec
        dictionary = read_dictionary(self._eds_path, spec.node_id)
        self.notes = check_dictionary(dictionary, spec)
        self.sdo = DriveParameters(self.client, dictionary, spec.name)

    def configuring(self) -> Writing:
        """Verify and configure a drive that has booted.

        Raises:
            WrongDevice: it is not the drive declared, or refuses a value.
            NoReply: it is silent.
            ProtocolError: a reply does not fit its request.
        """
        spec, port = self.port.spec, self.port
        yield from verify_drive(self.sdo, spec)
        told = torque_is_told(self.sdo.dictionary)
        position_pdo = TPDO2 if told else TPDO2_WITHOUT_TORQUE
        yield from lay_out_pdos(self.sdo, spec.node_id, (RPDO1, TPDO1, position_pdo))
        port.position_wire = position_pdo.wire
        if told:
            port.rated_torque_nm = yield from read_rated_torque(self.sdo)
        yield from set_mode(self.sdo, spec.mode, self._clock)
        yield from configure_drive(
            self.sdo,
            spec,
            host_node_id=self._host_node_id,
            heartbeat_ms=self._heartbeat_ms,
            cycle_ms=self._cycle_ms,
        )
