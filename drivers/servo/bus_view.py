"""Show another bus in a changed way: what a view does not change is passed on."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drivers.errors import DriverError
from drivers.servo.bus import ServoBusDriver
from drivers.servo.joint_servo import JointServo
from drivers.servo.journal import BusJournal


class BusView:
    """Pass everything but the state on to a bus, of whose servos the first `count` are shown."""

    def __init__(self, bus: ServoBusDriver, count: int) -> None:
        """Take over a bus."""
        self._bus = bus
        self._count = count

    @property
    def servos(self) -> tuple[JointServo, ...]:
        """Return the servos that are shown, in the order of all arrays."""
        return self._bus.servos[: self._count]

    @property
    def journal(self) -> BusJournal:
        """Return what is told of every cycle, of each servo by itself."""
        return self._bus.journal

    def connect(self, *, thorough: bool = True) -> object:
        """Check that every servo is the declared one and set it up; torque is left as it is.

        Raises:
            DriverError: a servo is silent or not as declared, or the adapter is unfit.
        """
        return self._bus.connect(thorough=thorough)

    def close(self) -> None:
        """Release the transport; torque is left as it is."""
        self._bus.close()

    def write_goals(self, position_rad: NDArray[np.float64]) -> None:
        """Send a goal to every joint.

        Raises:
            ValueError: a goal is not finite, or there is not one per joint.
            LinkLost: the adapter is gone.
        """
        self._bus.write_goals(position_rad)

    def write_speeds(self, speed_rad_s: NDArray[np.float64]) -> None:
        """Send a speed to every servo that turns a wheel.

        Raises:
            ValueError: a speed is not finite, or there is not one per wheel.
            LinkLost: the adapter is gone.
        """
        self._bus.write_speeds(speed_rad_s)

    def limit_effort(self, ratios: Mapping[int, float]) -> dict[int, DriverError]:
        """Limit servos (by id) to a ratio of full duty; return those that did not take it.

        Raises:
            LinkLost: the adapter is gone.
        """
        return self._bus.limit_effort(ratios)

    def disable_torque(self, ids: Sequence[int] | None = None) -> dict[int, DriverError]:
        """Switch servos (all by default) off; failures are returned by id.

        Raises:
            LinkLost: the adapter is gone.
        """
        return self._bus.disable_torque(ids)

    def clear_watchdog(self) -> None:
        """Let servos that have stopped by themselves take goals again.

        Raises:
            DriverError: a servo is silent or refuses.
        """
        self._bus.clear_watchdog()

    def reboot(self, servo_id: int) -> None:
        """Restart a servo and return at once.

        Raises:
            DriverError: it does not answer.
        """
        self._bus.reboot(servo_id)

    def telemetry(self) -> dict[str, Any]:
        """Return counters, cycle times and error budgets by name."""
        return self._bus.telemetry()
