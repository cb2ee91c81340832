"""Declare how one servo of any family is driven at the bench with little torque."""

from dataclasses import dataclass
from typing import Final, Protocol

DRIVE_WATCHDOG_S: Final = 0.5
"""A servo that has a bus watchdog stops by itself when the bench is silent for so long."""


@dataclass(frozen=True, slots=True, kw_only=True)
class DrivenSample:
    """Hold what a driven servo senses; `duty_ratio` is the share of full duty on its motor."""

    pulse: int
    duty_ratio: float


class GentleDrive(Protocol):
    """Drive one servo by goals, with its torque bounded by a register that it forgets.

    What is changed for that is read first, when the drive is made, and written back by
    `let_go`. All methods raise ServoSilent, CorruptReply or Rejected for the servo, and LinkLost.
    """

    @property
    def pulse_range(self) -> tuple[int, int]:
        """Return between which pulses the servo takes goals."""
        ...

    def hold(self) -> None:
        """Bound the torque, then hold the servo where it is.

        Raises:
            ServoFault: it reports an error that takes its torque away.
        """
        ...

    def go_to(self, pulse: int) -> None:
        """Give the servo a goal."""
        ...

    def sense(self) -> DrivenSample:
        """Ask where the servo is, and what it gives."""
        ...

    def let_go(self) -> None:
        """Take the torque away, or hold where it held before, and put everything else back."""
        ...
