"""Check that a drive is the one declared and write its parameters over SDO."""

from collections.abc import Iterator
from typing import Final

import canopen
from canopen.sdo.exceptions import SdoError

from drivers.canopen.network import PumpedSdoClient
from drivers.canopen.objects import (
    ABORT_CONNECTION_OPTION,
    CIA402_PROFILE,
    DEVICE_TYPE,
    ENCODER_RESOLUTION,
    FAULT_REACTION_OPTION,
    GEAR_RATIO,
    HEARTBEAT_CONSUMER,
    HEARTBEAT_PRODUCER,
    IDENTITY,
    MODE_OF_OPERATION,
    PDOS,
    PROFILE_ACCELERATION,
    PROFILE_DECELERATION,
    QUICK_STOP_DECELERATION,
    QUICK_STOP_OPTION,
    RATED_TORQUE,
    RATED_TORQUE_PER_NM,
    AbortConnection,
    OperatingMode,
)
from drivers.canopen.spec import DriveSpec
from drivers.errors import NoReply, ProtocolError, WrongDevice

SLOW_DOWN_THEN_DISABLE: Final = 2
HEARTBEATS_PER_LIMIT: Final = 4


class DriveParameters:
    """Read and write the objects of one drive."""

    def __init__(self, client: PumpedSdoClient, spec: DriveSpec) -> None:
        self._client = client
        self._spec = spec
        self._name = f"drive {spec.joint} (node {spec.node_id})"

    def read(self, index: int, subindex: int = 0) -> int:
        """Return an unsigned object.

        Raises:
            NoReply: the drive is silent.
            WrongDevice: the drive has no such object.
            ProtocolError: the reply does not fit the request.
        """
        try:
            return int.from_bytes(self._client.upload(index, subindex), "little")
        except SdoError as error:
            raise self._translated(error, f"reading 0x{index:04X}:{subindex:X}") from error

    def write(self, index: int, subindex: int, value: int) -> None:
        """Write an object with the size that the EDS declares.

        Raises:
            NoReply: the drive is silent.
            WrongDevice: the drive refuses the value.
            ProtocolError: the reply does not fit the request.
        """
        data = self._client.od.get_variable(index, subindex).encode_raw(value)
        try:
            self._client.download(index, subindex, data)
        except SdoError as error:
            raise self._translated(
                error, f"writing {value} to 0x{index:04X}:{subindex:X}"
            ) from error

    def _translated(self, error: SdoError, doing: str) -> Exception:
        what = f"{self._name}: {doing}: {error}"
        if isinstance(error, canopen.SdoAbortedError):
            return WrongDevice(f"{what}; check that the EDS file fits the drive")
        if "No SDO response" in str(error):
            return NoReply(f"{what}; check its power, node id, bit rate and the bus termination")
        return ProtocolError(what)

    def check(self, expected: Iterator[tuple[str, int, int, int]]) -> None:
        """Compare objects with what is expected of them.

        Raises:
            WrongDevice: one differs.
        """
        for what, index, subindex, value in expected:
            got = self.read(index, subindex)
            if got != value:
                raise WrongDevice(
                    f"{self._name}: {what} 0x{index:04X}:{subindex:X} is 0x{got:X}, expected "
                    f"0x{value:X}; correct the robot file or the drive's configuration"
                )


def verify_drive(client: PumpedSdoClient, spec: DriveSpec) -> float:
    """Check profile, identity, encoder and PDO layout of a drive; return its rated torque in N·m.

    Raises:
        WrongDevice: it is not the drive that EDS and robot file declare.
        NoReply: the drive is silent.
    """
    parameters = DriveParameters(client, spec)
    profile = parameters.read(DEVICE_TYPE) & 0xFFFF
    if profile != CIA402_PROFILE:
        raise WrongDevice(f"drive {spec.joint} (node {spec.node_id}): profile {profile}, not 402")
    parameters.check(_identity(client.od))
    parameters.check(_encoder(spec))
    parameters.check(_pdo_layout(spec.node_id))
    return parameters.read(RATED_TORQUE) / RATED_TORQUE_PER_NM


def _identity(od: canopen.ObjectDictionary) -> Iterator[tuple[str, int, int, int]]:
    yield "vendor", IDENTITY, 1, od[IDENTITY][1].default
    yield "product", IDENTITY, 2, od[IDENTITY][2].default


def _encoder(spec: DriveSpec) -> Iterator[tuple[str, int, int, int]]:
    yield "encoder increments", ENCODER_RESOLUTION, 1, spec.counts_per_rev
    yield "encoder revolutions", ENCODER_RESOLUTION, 2, 1
    yield "gear, motor side", GEAR_RATIO, 1, 1
    yield "gear, shaft side", GEAR_RATIO, 2, 1


def _pdo_layout(node_id: int) -> Iterator[tuple[str, int, int, int]]:
    for pdo in PDOS:
        yield "PDO identifier", pdo.communication, 1, pdo.cob_base + node_id
        yield "PDO transmission type", pdo.communication, 2, pdo.transmission
        yield "PDO mapped objects", pdo.mapping, 0, len(pdo.entries)
        for subindex, entry in enumerate(pdo.entries, start=1):
            yield "PDO mapping", pdo.mapping, subindex, entry


def configure_drive(
    client: PumpedSdoClient, spec: DriveSpec, *, host_node_id: int, heartbeat_ms: int
) -> None:
    """Write mode, ramps, stop reactions and both heartbeats.

    A lost host puts the drive into FAULT: it brakes on its quick stop ramp, then power is off
    until an explicit fault reset.

    Raises:
        WrongDevice: the drive refuses a value.
        NoReply: the drive is silent.
    """
    parameters = DriveParameters(client, spec)
    counts_per_rad = abs(spec.counts_per_rad)
    ramp = round(spec.acceleration_rad_s2 * counts_per_rad)
    table = (
        (MODE_OF_OPERATION, 0, OperatingMode.PROFILE_VELOCITY),
        (PROFILE_ACCELERATION, 0, ramp),
        (PROFILE_DECELERATION, 0, ramp),
        (QUICK_STOP_DECELERATION, 0, round(spec.quick_stop_rad_s2 * counts_per_rad)),
        (QUICK_STOP_OPTION, 0, SLOW_DOWN_THEN_DISABLE),
        (FAULT_REACTION_OPTION, 0, SLOW_DOWN_THEN_DISABLE),
        (ABORT_CONNECTION_OPTION, 0, AbortConnection.FAULT),
        (HEARTBEAT_PRODUCER, 0, max(1, heartbeat_ms // HEARTBEATS_PER_LIMIT)),
        (HEARTBEAT_CONSUMER, 1, host_node_id << 16 | heartbeat_ms),
    )
    for index, subindex, value in table:
        parameters.write(index, subindex, int(value))
