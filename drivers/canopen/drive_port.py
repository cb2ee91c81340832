"""Keep what one drive has said: the receiving half of the PDO cycle."""

import math
import struct
from typing import Final

from drivers.canopen.cia402 import FAULT_STATES, decode_statusword
from drivers.canopen.emergency import Emergency, decode_emergency
from drivers.canopen.objects import (
    TORQUE_STEPS_PER_RATED,
    TPDO1,
    TPDO2,
    NmtState,
)
from drivers.canopen.spec import DriveSpec
from drivers.clock import NS_PER_S
from drivers.errors import ProtocolError
from drivers.wheel_drives.bus import PowerState, ResetRule

_STATUS: Final = 0b01
_POSITION: Final = 0b10
_BOTH: Final = _STATUS | _POSITION


def counts_moved(old: int, new: int) -> int:
    """Return the shortest way between two readings of a wrapping 32-bit counter."""
    return (new - old + 0x8000_0000) % 0x1_0000_0000 - 0x8000_0000


class DrivePort:
    """Decode the frames of one drive and judge whether it is alive."""

    def __init__(self, spec: DriveSpec, heartbeat_limit_ns: int) -> None:
        self.spec = spec
        self._counts_per_rad = spec.counts_per_rad
        self.rated_torque_nm = math.nan
        self.position_wire = TPDO2.wire
        self._limit_ns = heartbeat_limit_ns
        self.forget()

    def forget(self) -> None:
        """Start over, as before the drive's first message."""
        self.fault: Emergency | None = None
        self.booted = False
        self.rebooted = False
        self.nmt_state: int | None = None
        self._counts: int | None = None
        self._travel_counts = 0
        self._heard_ns: int | None = None
        self.forget_samples()

    def forget_samples(self) -> None:
        """Forget all process data, as before they are started."""
        self.power_state = PowerState.UNKNOWN
        self.velocity_rad_s = 0.0
        self.torque_nm = math.nan
        self._sample_ns: dict[int, int] = {}
        self._sync_ns = 0
        self._awaited = 0
        self._awaited_since_ns = 0

    @property
    def position_rad(self) -> float:
        """Return the joint angle travelled since the drive was reset; it does not wrap."""
        return self._travel_counts / self._counts_per_rad

    @property
    def complete(self) -> bool:
        """Return whether both status and position have arrived."""
        return len(self._sample_ns) == 2

    @property
    def operational(self) -> bool:
        """Return whether process data have arrived, and a heartbeat that fits them."""
        return self.complete and self.nmt_state == NmtState.OPERATIONAL

    @property
    def faulted(self) -> bool:
        """Return whether the drive is in one of its fault states."""
        return self.power_state in FAULT_STATES

    @property
    def owes_answers(self) -> bool:
        """Return whether the last SYNC is not answered yet."""
        return bool(self._awaited)

    @property
    def reset_rule(self) -> ResetRule:
        """Return who may reset the drive's fault; a fault without a code is the operator's."""
        return ResetRule.OPERATOR if self.fault is None else self.fault.rule

    def age_s(self, now_ns: int) -> float:
        """Return the time since the older of both samples was taken; infinite before the first."""
        if not self.complete:
            return math.inf
        return (now_ns - min(self._sample_ns.values())) / NS_PER_S

    def lost(self, now_ns: int) -> bool:
        """Return whether the drive is silent beyond the limit, rebooted or not operational."""
        silent = self._heard_ns is None or now_ns - self._heard_ns > self._limit_ns
        unanswered = bool(self._awaited) and now_ns - self._awaited_since_ns > self._limit_ns
        return silent or unanswered or self.rebooted or self.nmt_state != NmtState.OPERATIONAL

    def expect_answers(self, sync_ns: int) -> None:
        """Note that a SYNC has asked for both TPDOs."""
        if not self._awaited:
            self._awaited_since_ns = sync_ns
        self._awaited = _BOTH
        self._sync_ns = sync_ns

    def on_status(self, data: bytes, now_ns: int) -> None:
        """Take TPDO1."""
        statusword, velocity = _unpacked(TPDO1.wire, data)
        self.power_state = decode_statusword(statusword)
        self.velocity_rad_s = velocity / self._counts_per_rad
        self._answered(_STATUS, now_ns)

    def on_position(self, data: bytes, now_ns: int) -> None:
        """Take TPDO2."""
        counts, *torque_steps = _unpacked(self.position_wire, data)
        if self.rebooted:
            return  # its counter began anew somewhere else
        if torque_steps:
            torque_ratio = torque_steps[0] / TORQUE_STEPS_PER_RATED
            motor_nm = torque_ratio * self.rated_torque_nm
            self.torque_nm = self.spec.sign * self.spec.gear_ratio * motor_nm
        if self._counts is None:
            self._travel_counts = counts
        else:
            self._travel_counts += counts_moved(self._counts, counts)
        self._counts = counts
        self._answered(_POSITION, now_ns)

    def _answered(self, which: int, now_ns: int) -> None:
        self._sample_ns[which] = self._sync_ns
        self._awaited &= ~which
        self._heard_ns = now_ns

    def on_heartbeat(self, data: bytes, now_ns: int) -> None:
        """Take a heartbeat or the boot-up message."""
        if len(data) != 1:
            raise ProtocolError(f"heartbeat has {len(data)} bytes, expected 1")
        self.nmt_state = data[0] & 0x7F
        self._heard_ns = now_ns
        if self.nmt_state == NmtState.BOOT_UP:
            self.rebooted = self.booted
            self.booted = True

    def on_emergency(self, data: bytes, now_ns: int) -> None:
        """Take an emergency message; keep the gravest until none is left, the newest of equals.

        Otherwise a lost heartbeat, told after a short circuit, would make that one harmless.
        """
        emergency = decode_emergency(data, now_ns)
        self._heard_ns = now_ns
        if emergency.takes_all_back:
            self.fault = None
        elif not emergency.is_reset and (
            self.fault is None or emergency.rule.gravity >= self.fault.rule.gravity
        ):
            self.fault = emergency


def _unpacked(wire: struct.Struct, data: bytes) -> tuple[int, ...]:
    if len(data) != wire.size:
        raise ProtocolError(f"PDO has {len(data)} bytes, expected {wire.size}")
    return wire.unpack(data)
