"""Check that a drive is the one declared and write its parameters over SDO, step by step."""

from collections.abc import Generator
from typing import Final

from drivers.canopen.cia402 import FAULT_STATES, decode_statusword
from drivers.canopen.error_codes import code_text, reset_rule
from drivers.canopen.objects import (
    ABORT_CONNECTION_OPTION,
    CIA402_PROFILE,
    DEVICE_TYPE,
    ENCODER_RESOLUTION,
    ERROR_CODE,
    ERROR_FIELD,
    FAULT_REACTION_OPTION,
    GEAR_RATIO,
    HEARTBEAT_CONSUMER,
    HEARTBEAT_PRODUCER,
    IDENTITY,
    INTERPOLATION_PERIOD,
    MODE_DISPLAY,
    MODE_OF_OPERATION,
    PROFILE_ACCELERATION,
    PROFILE_DECELERATION,
    QUICK_STOP_DECELERATION,
    QUICK_STOP_OPTION,
    RATED_TORQUE,
    RATED_TORQUE_PER_NM,
    STATUSWORD,
    SUPPORTED_MODES,
    AbortConnection,
    DriveMode,
)
from drivers.canopen.parameters import DriveParameters, Expected
from drivers.canopen.sdo import Writing
from drivers.canopen.spec import DriveSpec
from drivers.clock import Clock
from drivers.errors import DeviceFault, NoReply, ProtocolError, WrongDevice
from drivers.wheel_drives.bus import ResetRule

SLOW_DOWN_THEN_DISABLE: Final = 2
HEARTBEATS_PER_LIMIT: Final = 4
MODE_TIMEOUT_NS: Final = 300_000_000
MILLISECONDS: Final = -3
CODE_MASK: Final = 0xFFFF  # the upper half of an entry is the vendor's

Step = tuple[int, int, int]


def refuse_unrepaired(parameters: DriveParameters) -> Writing:
    """Look, before a reset would wipe it, whether a drive has a fault that only repair may end.

    A drive that does not answer yet is left to the boot that follows.

    Raises:
        DeviceFault: it has one.
    """
    try:
        status = yield from parameters.read(STATUSWORD)
        if decode_statusword(status) not in FAULT_STATES:
            return
        codes = [(yield from parameters.read(ERROR_CODE))]
        codes += yield from _earlier_codes(parameters)
    except (NoReply, WrongDevice, ProtocolError):
        return
    for code in codes:
        if reset_rule(code) is ResetRule.NEVER:
            raise DeviceFault(
                f"{parameters.name}: {code_text(code)}; it is reset {ResetRule.NEVER.value}"
            )


def _earlier_codes(parameters: DriveParameters) -> Generator[None, None, list[int]]:
    """Return the codes of the error field: a heartbeat lost later hides what came first."""
    codes: list[int] = []
    if not parameters.dictionary.has(ERROR_FIELD):
        return codes
    try:
        count = yield from parameters.read(ERROR_FIELD)
        while len(codes) < count:
            entry = yield from parameters.read(ERROR_FIELD, len(codes) + 1)
            codes.append(entry & CODE_MASK)
    except (NoReply, WrongDevice, ProtocolError):
        return codes
    return codes


def verify_drive(parameters: DriveParameters, spec: DriveSpec) -> Writing:
    """Check profile, identity, encoder and modes of a drive.

    Raises:
        WrongDevice: it is not the drive that EDS and robot file declare.
        NoReply: the drive is silent.
    """
    profile = (yield from parameters.read(DEVICE_TYPE)) & 0xFFFF
    if profile != CIA402_PROFILE:
        raise WrongDevice(f"{spec.name}: device profile is {profile}, expected {CIA402_PROFILE}")
    yield from parameters.check(_identity(parameters))
    yield from parameters.check(_encoder(spec))
    if parameters.dictionary.has(SUPPORTED_MODES):
        modes = yield from parameters.read(SUPPORTED_MODES)
        if not modes >> (spec.mode - 1) & 1:
            raise WrongDevice(
                f"{spec.name}: supports modes 0x{modes:X} (0x6502), not {spec.mode.words}; "
                "correct `mode` in the robot file"
            )


def _identity(parameters: DriveParameters) -> Expected:
    for what, subindex in (("vendor", 1), ("product", 2)):
        declared = parameters.dictionary.default(IDENTITY, subindex)
        if declared:
            yield what, IDENTITY, subindex, declared


def _encoder(spec: DriveSpec) -> Expected:
    yield "encoder increments", ENCODER_RESOLUTION, 1, spec.counts_per_rev
    yield "encoder revolutions", ENCODER_RESOLUTION, 2, 1
    yield "gear, motor side", GEAR_RATIO, 1, 1
    yield "gear, shaft side", GEAR_RATIO, 2, 1


def read_rated_torque(parameters: DriveParameters) -> Generator[None, None, float]:
    """Return the rated torque in N·m."""
    steps = yield from parameters.read(RATED_TORQUE)
    return steps / RATED_TORQUE_PER_NM


def set_mode(parameters: DriveParameters, mode: DriveMode, clock: Clock) -> Writing:
    """Choose the mode of operation and wait until the drive displays it.

    Raises:
        WrongDevice: it displays another one.
    """
    yield from parameters.write(MODE_OF_OPERATION, 0, int(mode))
    deadline_ns = clock.now_ns() + MODE_TIMEOUT_NS
    while (shown := (yield from parameters.read(MODE_DISPLAY))) != mode:
        if clock.now_ns() > deadline_ns:
            raise WrongDevice(
                f"{parameters.name}: mode of operation display 0x6061 is {shown}, expected "
                f"{int(mode)} ({mode.words}); check that the drive is set up for this mode"
            )
        yield


def configure_drive(
    parameters: DriveParameters,
    spec: DriveSpec,
    *,
    host_node_id: int,
    heartbeat_ms: int,
    cycle_ms: int,
) -> Writing:
    """Write ramps, stop reactions and both heartbeats; pass over what the drive does not have.

    A lost host puts the drive into FAULT: it brakes on its quick stop ramp, then power is off
    until an explicit fault reset.

    Raises:
        WrongDevice: the drive refuses a value.
        NoReply: the drive is silent.
    """
    steps = (
        *_ramps(spec, cycle_ms),
        (QUICK_STOP_DECELERATION, 0, round(spec.quick_stop_rad_s2 * abs(spec.counts_per_rad))),
        (QUICK_STOP_OPTION, 0, SLOW_DOWN_THEN_DISABLE),
        (FAULT_REACTION_OPTION, 0, SLOW_DOWN_THEN_DISABLE),
        (ABORT_CONNECTION_OPTION, 0, int(AbortConnection.FAULT)),
        (HEARTBEAT_PRODUCER, 0, max(1, heartbeat_ms // HEARTBEATS_PER_LIMIT)),
        (HEARTBEAT_CONSUMER, 1, host_node_id << 16 | heartbeat_ms),
    )
    for index, subindex, value in steps:
        if parameters.dictionary.has(index, subindex):
            yield from parameters.write(index, subindex, value)


def _ramps(spec: DriveSpec, cycle_ms: int) -> tuple[Step, ...]:
    if spec.mode is DriveMode.CYCLIC_SYNCHRONOUS_VELOCITY:
        return (INTERPOLATION_PERIOD, 1, cycle_ms), (INTERPOLATION_PERIOD, 2, MILLISECONDS)
    # Control's own ramps are the slower ones; where it must brake, the drive is not in its way.
    faster = round(spec.acceleration_rad_s2 * abs(spec.counts_per_rad))
    slower = round(spec.quick_stop_rad_s2 * abs(spec.counts_per_rad))
    return (PROFILE_ACCELERATION, 0, faster), (PROFILE_DECELERATION, 0, slower)
