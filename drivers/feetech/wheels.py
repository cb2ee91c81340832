"""Send servos in velocity mode how fast to turn the wheels; in doubt, not at all."""

from collections.abc import Collection, Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from drivers.feetech.link import FeetechLink
from drivers.feetech.servo import FeetechServo
from drivers.feetech.torque import write_kept
from drivers.servo.members import require_goals

_SPEED: Final = "goal_velocity"


class FeetechWheels:
    """Write the goal speeds of all wheels of a bus in one sync write.

    A wheel goes on at its last goal for as long as it has power, whether anybody talks to it or
    not: these servos have no bus watchdog.
    """

    def __init__(self, link: FeetechLink, servos: Sequence[FeetechServo]) -> None:
        """Take the servos of the wheels, in the order of all speeds."""
        self._link = link
        self._servos = tuple(servos)
        self._names = [servo.joint for servo in servos]
        self._steps_per_rad = np.array([1.0 / servo.joint_per_pulse for servo in servos])
        self._most_steps = np.array(
            [servo.wheel.speed_rad_s / servo.pulse_rad if servo.wheel else 0.0 for servo in servos]
        )

    def write(self, speed_rad_s: NDArray[np.float64], halted: Collection[int] = ()) -> None:
        """Send a speed to every wheel; those in the rows `halted` are told to stand still.

        Raises:
            ValueError: a speed is not finite, or there is not one per wheel.
            LinkLost: the adapter is gone.
        """
        require_goals(self._names, speed_rad_s)
        steps = np.rint(speed_rad_s * self._steps_per_rad)
        bounded = np.minimum(np.maximum(steps, -self._most_steps), self._most_steps)
        values = [0 if row in halted else int(one) for row, one in enumerate(bounded.tolist())]
        if values:
            self._link.write_each(self._servos, _SPEED, values)

    def halt(self) -> None:
        """Send every wheel the speed zero; nobody answers.

        Raises:
            LinkLost: the adapter is gone.
        """
        if self._servos:
            self._link.write_each(self._servos, _SPEED, [0] * len(self._servos))

    def confirm_halt(self) -> None:
        """Send every wheel the speed zero, and read back that it holds it.

        Raises:
            NotKept: a wheel holds another speed.
            ServoSilent: a wheel does not answer.
            LinkLost: the adapter is gone.
        """
        if self._servos:
            write_kept(self._link, self._servos, [{_SPEED: 0}] * len(self._servos))
