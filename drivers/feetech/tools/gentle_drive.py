"""Drive one FEETECH servo gently: its torque limit (48) bounds the duty until its power is cut.

There is no bus watchdog: what a servo does when the computer dies is bounded by the last goal and
by that limit. The next program that arms it writes the limit anew.
"""

from typing import Final

from drivers.feetech.block import BLOCK_BYTES, BLOCK_START
from drivers.feetech.checks import read_images
from drivers.feetech.link import SETUP_PATIENCE, FeetechLink, value_in
from drivers.feetech.servo import FeetechServo
from drivers.feetech.settings import setup_of
from drivers.feetech.table import LOAD_FULL, FeetechMode, TorqueSwitch
from drivers.feetech.torque import switch_torque_off, switch_torque_on
from drivers.servo.errors import CorruptReply, ServoSilent, WrongServo
from drivers.servo.tools.gentle_drive import DrivenSample

_BORROWED: Final = (
    *("position_p_gain", "position_d_gain", "acceleration", "goal_time", "goal_velocity"),
    "torque_limit",
)


class FeetechDrive:
    """Drive a servo of a bench's bus; nothing is written before `hold`."""

    def __init__(self, link: FeetechLink, servo: FeetechServo, torque_ratio: float) -> None:
        """Read what will be changed.

        Raises:
            WrongServo: it has no torque limit, or is not in position mode.
            ServoSilent: no answer.
            LinkLost: the adapter is gone.
        """
        self._link = link
        self._servo = servo
        self._limit = round(torque_ratio * LOAD_FULL)
        if "torque_limit" not in servo.datasheet.registers:
            raise WrongServo(f"{servo}: it has no torque limit: calibrate it by hand")
        if (mode := link.read(servo, "operating_mode")) != FeetechMode.POSITION:
            raise WrongServo(f"{servo}: expected operating_mode 0, position; got {mode}")
        image = read_images(link, [servo]).get(servo.id)
        if image is None:
            raise ServoSilent(f"no answer from {servo}; check power and cable")
        self._setup = setup_of(servo, image, torque_limit=self._limit)
        self._before = {name: link.read(servo, name) for name in _BORROWED}

    @property
    def pulse_range(self) -> tuple[int, int]:
        """Return the position limits of the servo."""
        return self._setup.minimum_pulse, self._setup.maximum_pulse

    def hold(self) -> None:
        """Bound the torque, then hold the servo where it is.

        Raises:
            ServoFault: it reports an error that takes its torque away, or stands outside of its
                position limits.
            ServoSilent: no answer.
            NotKept: it refuses a step.
            LinkLost: the adapter is gone.
        """
        self._link.write(self._servo, "torque_limit", self._limit)  # of one that holds already
        switch_torque_on(self._link, [self._servo], [self._setup])

    def go_to(self, pulse: int) -> None:
        """Give the servo a goal.

        Raises:
            ServoSilent: no answer.
            LinkLost: the adapter is gone.
        """
        self._link.write(self._servo, "goal_position", pulse)

    def sense(self) -> DrivenSample:
        """Ask where the servo is, and what it gives.

        Raises:
            CorruptReply: no undamaged answer.
            LinkLost: the adapter is gone.
        """
        spans = self._link.read_spans([self._servo], BLOCK_START, BLOCK_BYTES, SETUP_PATIENCE)
        if self._servo.id not in spans:
            raise CorruptReply(f"{self._servo}: no whole answer; check power and cable")
        params = spans[self._servo.id].params
        return DrivenSample(
            pulse=value_in(self._servo, params, BLOCK_START, "present_position"),
            duty_ratio=value_in(self._servo, params, BLOCK_START, "present_load") / LOAD_FULL,
        )

    def let_go(self) -> None:
        """Take the torque away, or hold where it held before, and put everything else back.

        Raises:
            ServoSilent: no answer.
            LinkLost: the adapter is gone.
        """
        if self._setup.torque_on:
            self.go_to(self.sense().pulse)
        else:
            for error in switch_torque_off(self._link, [self._servo]).values():
                raise error
        for name, value in self._before.items():
            self._link.write(self._servo, name, value)
        if self._setup.torque_on:  # an error in `hold` took it away
            self._link.write(self._servo, "torque_enable", TorqueSwitch.ON)
