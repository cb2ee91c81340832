"""Carry out what the fault policy decides about a servo's hardware error.

Safety holds the robot at any hardware error; this is about the servo itself. An overloaded one is
not rebooted by itself here: the operator's reset does that, when the load has been looked at.
"""

from collections import deque
from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Final

from drivers.servo.bus import ServoBusDriver
from drivers.servo.fault_policy import (
    DEFAULT_RULES,
    FaultAction,
    FaultDecision,
    FaultPolicy,
    FaultRule,
)
from drivers.servo.hardware_error import HardwareError

_TOLD: Final = 3
RULES: Final[Mapping[HardwareError, FaultRule]] = MappingProxyType(
    {
        **DEFAULT_RULES,
        HardwareError.OVERLOAD: FaultRule(
            action=FaultAction.LIMP,
            reason="something holds the joint; look at it, a reset reboots the servo",
        ),
    }
)


class ServoFaults:
    """Remember the newest decisions, and what was rebooted, over every reopening of the bus."""

    def __init__(self, rules: Mapping[HardwareError, FaultRule] = RULES) -> None:
        self.policy = FaultPolicy(rules)
        self._newest: deque[str] = deque(maxlen=_TOLD)

    @property
    def newest(self) -> list[str]:
        """Return the newest decisions in words, the latest last."""
        return list(self._newest)

    def carry_out(self, bus: ServoBusDriver) -> None:
        """Do what was decided since the last call.

        Raises:
            DriverError: a servo does not obey; the others were not tried yet.
        """
        for decision in bus.journal.take_decisions():
            self._newest.append(str(decision))
            if act := _ACTS.get(decision.action):
                act(bus, decision)


def _limp(bus: ServoBusDriver, decision: FaultDecision) -> None:
    for error in bus.disable_torque([decision.servo_id]).values():
        raise error


def _reboot(bus: ServoBusDriver, decision: FaultDecision) -> None:
    bus.reboot(decision.servo_id)


_Act = Callable[[ServoBusDriver, FaultDecision], None]
_ACTS: Final[Mapping[FaultAction, _Act]] = MappingProxyType(
    {FaultAction.LIMP: _limp, FaultAction.REBOOT_ONCE: _reboot}
)
"""Nothing more is to be done for the others: safety stops the robot by the same error bits."""
