"""Decide what to do about a servo's hardware error: one table row per bit.

The policy only decides. Whoever owns the bus carries the decision out, and the safety code is told
of every `STOP`.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import IntEnum
from types import MappingProxyType
from typing import Final

from drivers.servo.hardware_error import HardwareError


class FaultAction(IntEnum):
    """Name the actions; of several bits the largest action counts."""

    LOG = 0
    REBOOT_ONCE = 1
    """Restart the servo, once until `acknowledge`: its torque stays off until it is armed again."""
    LIMP = 2
    """Switch the torque of this servo off."""
    STOP = 3
    """Report to safety, which stops the robot."""


@dataclass(frozen=True, slots=True, kw_only=True)
class FaultRule:
    """Say what to do about one error bit, and why."""

    action: FaultAction
    reason: str


DEFAULT_RULES: Final[Mapping[HardwareError, FaultRule]] = MappingProxyType(
    {
        HardwareError.INPUT_VOLTAGE: FaultRule(
            action=FaultAction.LOG,
            reason="the supply is out of the servo's limits; the motor still obeys",
        ),
        HardwareError.OVERHEATING: FaultRule(
            action=FaultAction.LIMP,
            reason="the motor must cool down before it may hold a load again",
        ),
        HardwareError.ENCODER: FaultRule(
            action=FaultAction.STOP,
            reason="the servo does not know where its shaft is",
        ),
        HardwareError.ELECTRICAL_SHOCK: FaultRule(
            action=FaultAction.STOP,
            reason="the power stage or its supply is damaged",
        ),
        HardwareError.OVERLOAD: FaultRule(
            action=FaultAction.REBOOT_ONCE,
            reason="a collision or a short overload is over once the torque is off",
        ),
        HardwareError.OVERCURRENT: FaultRule(
            action=FaultAction.LIMP,
            reason="the motor draws more than it may: something blocks it, or it is shorted",
        ),
    }
)
_UNKNOWN: Final = FaultRule(
    action=FaultAction.STOP, reason="the manual does not name this bit; treat it as the worst"
)


@dataclass(frozen=True, slots=True, kw_only=True)
class FaultDecision:
    """Hold one decision with all that a log line needs."""

    servo_id: int
    joint: str
    bits: int
    errors: str
    action: FaultAction
    reason: str

    def __str__(self) -> str:
        action = self.action.name.lower().replace("_", " ")
        return f"servo {self.servo_id} ({self.joint}): {self.errors}: {action}; {self.reason}"


class FaultPolicy:
    """Turn changes of the hardware error status into decisions, one servo at a time."""

    def __init__(self, rules: Mapping[HardwareError, FaultRule] = DEFAULT_RULES) -> None:
        self._rules = rules
        self._seen: dict[int, int] = {}
        self._rebooted: set[int] = set()

    def decide(self, servo_id: int, joint: str, bits: int) -> FaultDecision | None:
        """Return the decision about the servo's error bits, None when they are not new.

        A bit that stays is decided about once; a bit that comes on top is decided about together
        with those before it. A servo that was rebooted and fails again is a `STOP`.
        """
        seen = self._seen.get(servo_id, 0)
        self._seen[servo_id] = bits
        if not bits & ~seen:
            return None
        rule = self._allowed(servo_id, self._worst(bits))
        return FaultDecision(
            servo_id=servo_id,
            joint=joint,
            bits=bits,
            errors=describe_bits(bits),
            action=rule.action,
            reason=rule.reason,
        )

    def acknowledge(self) -> None:
        """Allow every servo another reboot: a person has looked, and has reset the robot."""
        self._rebooted.clear()

    def _worst(self, bits: int) -> FaultRule:
        rules = [self._rules.get(HardwareError(bit), _UNKNOWN) for bit in _single_bits(bits)]
        return max(rules, key=lambda rule: rule.action)

    def _allowed(self, servo_id: int, rule: FaultRule) -> FaultRule:
        if rule.action is not FaultAction.REBOOT_ONCE:
            return rule
        if servo_id in self._rebooted:
            return FaultRule(
                action=FaultAction.STOP,
                reason="it was rebooted once and failed again; look at it, then reset",
            )
        self._rebooted.add(servo_id)
        return rule


def describe_bits(bits: int) -> str:
    """Return error bits in words; a bit without a name is told by its number."""
    return ", ".join(_name(bit) for bit in _single_bits(bits)) or "none"


def _single_bits(bits: int) -> list[int]:
    return [1 << place for place in range(bits.bit_length()) if bits >> place & 1]


def _name(bit: int) -> str:
    known = HardwareError._value2member_map_.get(bit)
    name = getattr(known, "name", None)
    return name.lower().replace("_", " ") if name else f"unknown bit {bit.bit_length() - 1}"
