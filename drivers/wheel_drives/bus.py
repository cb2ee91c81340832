"""Declare the contract that every bus of wheel drives keeps, whatever protocol it speaks."""

from collections.abc import Iterator
from dataclasses import dataclass
from enum import Enum
from typing import Final, Protocol

import numpy as np
from numpy.typing import NDArray


class PowerState(Enum):
    """Name the states of the CiA 402 power drive system; other protocols map theirs to them."""

    UNKNOWN = "unknown"
    NOT_READY = "not ready to switch on"
    SWITCH_ON_DISABLED = "switch on disabled"
    READY_TO_SWITCH_ON = "ready to switch on"
    SWITCHED_ON = "switched on"
    OPERATION_ENABLED = "operation enabled"
    QUICK_STOP_ACTIVE = "quick stop active"
    FAULT_REACTION_ACTIVE = "fault reaction active"
    FAULT = "fault"


class DriveGoal(Enum):
    """Name what the host wants of all its drives."""

    DISABLED = "disabled"
    ENABLED = "enabled"
    QUICK_STOP = "quick stop"
    FAULT_RESET = "fault reset"


class ResetRule(Enum):
    """Name who may take a fault back."""

    AUTOMATIC = "with the next connection"
    OPERATOR = "by the operator's reset"
    NEVER = "only after repair, by switching the supply off and on"

    @property
    def gravity(self) -> int:
        """Return how strict the rule is; more is stricter."""
        return _GRAVITY[self]


_GRAVITY: Final = {rule: gravity for gravity, rule in enumerate(ResetRule)}


class DriveFault(Protocol):
    """Hold what a drive complains about."""

    @property
    def code(self) -> int:
        """Return the drive's own number for it."""
        ...

    @property
    def text(self) -> str:
        """Return it in words."""
        ...

    @property
    def rule(self) -> ResetRule:
        """Return who may take it back."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class DriveState:
    """Hold what is known of all drives at one tick, in the order of their specs.

    `age_s` is the time since the values were sampled. `lost` marks a drive that has gone silent,
    rebooted or left its operational state; `faulted` one in a fault state; `fault` is the gravest
    complaint that was not taken back. A torque that the drive does not tell is NaN.
    """

    position_rad: NDArray[np.float64]
    velocity_rad_s: NDArray[np.float64]
    torque_nm: NDArray[np.float64]
    age_s: NDArray[np.float64]
    power_state: tuple[PowerState, ...]
    lost: tuple[bool, ...]
    faulted: tuple[bool, ...]
    fault: tuple[DriveFault | None, ...]
    enabled: bool

    @property
    def healthy(self) -> bool:
        """Return whether no drive is lost or faulted."""
        return not any(self.lost) and not any(self.faulted)


class DriveBus(Protocol):
    """Command all wheel drives of one bus; nothing but `connect` waits.

    Every drive stops by itself when the calls of `cycle` stop; servos without a bus watchdog do
    not, and say so (docs/safety.md).
    """

    @property
    def enabled(self) -> bool:
        """Return whether all drives follow their velocities."""
        ...

    @property
    def counters(self) -> dict[str, int] | None:
        """Return what link and drives have counted since the start; None on another bus's line."""
        ...

    @property
    def notes(self) -> tuple[str, ...]:
        """Return what the drives cannot do, in words; complete after connecting."""
        ...

    def connecting(self) -> Iterator[None]:
        """Check and configure every drive step by step; all end up disabled.

        A step never waits: it yields where it would, for the caller to step on later.

        Raises:
            NoReply: a drive does not answer in time.
            WrongDevice: a drive is not the one declared, or refuses a value.
            DeviceFault: a drive has a fault that no reset may take back.
            LinkLost: the bus has gone.
        """
        ...

    def connect(self) -> None:
        """Do all of `connecting`, waiting in between.

        Raises:
            DriverError: as `connecting` does.
        """
        ...

    def cycle(self, velocity_rad_s: NDArray[np.float64] | None) -> DriveState:
        """Read what has arrived, send setpoints and return the drives' state.

        Velocities are the joints', in the order of the specs; None, or drives that are not all
        enabled, sends zero.

        Raises:
            LinkLost: the bus has gone.
            ValueError: a velocity is not finite.
        """
        ...

    def enable(self) -> None:
        """Begin to power all drives; `enabled` tells when they follow."""
        ...

    def disable(self) -> None:
        """Take the power off all drives."""
        ...

    def cut_power(self) -> None:
        """Take the power off all drives at once, as a stop of category 0 asks.

        Where the protocol can, the drives then refuse power until `reset_fault`.

        Raises:
            LinkLost: the bus has gone.
        """
        ...

    def quick_stop(self) -> None:
        """Let all drives brake on their ramp and then take their power off."""
        ...

    def reset_fault(self) -> tuple[str, ...]:
        """Take back what faults may be taken back, and return why the others may not."""
        ...

    def close(self) -> None:
        """Leave the drives without power and leave the bus; closing twice is allowed."""
        ...
