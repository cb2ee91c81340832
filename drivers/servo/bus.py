"""Declare what every servo bus does, so that its owner need not know the family of the servos."""

from collections.abc import Mapping, Sequence
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from drivers.errors import DriverError
from drivers.servo.joint_servo import JointServo
from drivers.servo.journal import BusJournal
from drivers.servo.state import BusState


class ServoBusDriver(Protocol):
    """Drive all servos of one bus; every method that sends may raise LinkLost."""

    @property
    def servos(self) -> tuple[JointServo, ...]:
        """Return the servos in the order of all arrays."""
        ...

    @property
    def journal(self) -> BusJournal:
        """Return what is told of every cycle."""
        ...

    def connect(self, *, thorough: bool = True) -> object:
        """Check that every servo is the declared one and set it up; torque is left as it is.

        Wheels are told to stand still, first of all. Unless `thorough` it ends with the first
        silent servo.

        Raises:
            DriverError: a servo is silent or not as declared, or the adapter is unfit.
        """
        ...

    def close(self) -> None:
        """Release the transport; torque is left as it is."""
        ...

    def read_state(self) -> BusState:
        """Refresh and return the state of all servos; the next call overwrites it."""
        ...

    def write_goals(self, position_rad: NDArray[np.float64]) -> None:
        """Send a goal to every servo but those that turn wheels.

        Raises:
            ValueError: a goal is not finite, or there is not one per servo.
        """
        ...

    def write_speeds(self, speed_rad_s: NDArray[np.float64]) -> None:
        """Send a speed to every servo that turns a wheel, in their order.

        One that has been silent is told to stand still, whatever its speed here.

        Raises:
            ValueError: a speed is not finite, or there is not one per wheel.
        """
        ...

    def limit_effort(self, ratios: Mapping[int, float]) -> dict[int, DriverError]:
        """Limit servos (by id) to a ratio of full duty; return those that did not take it."""
        ...

    def enable_torque(self, ids: Sequence[int] | None = None) -> None:
        """Hold servos (all by default) at their present pose, their watchdogs armed.

        Raises:
            DriverError: a servo is silent, reports an error or refuses.
        """
        ...

    def disable_torque(self, ids: Sequence[int] | None = None) -> dict[int, DriverError]:
        """Switch servos (all by default) off; failures are returned by id."""
        ...

    def clear_watchdog(self) -> None:
        """Let servos that have stopped by themselves take goals again.

        Raises:
            DriverError: a servo is silent or refuses.
        """
        ...

    def reboot(self, servo_id: int) -> None:
        """Restart a servo and return at once; it rejoins, without torque, when it answers again.

        Raises:
            DriverError: it does not answer.
        """
        ...

    def telemetry(self) -> dict[str, Any]:
        """Return counters, cycle times and error budgets by name."""
        ...
