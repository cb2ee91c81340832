"""Declare one FEETECH servo of a robot."""

from dataclasses import dataclass

from drivers.feetech.codec import FEETECH_MAX_ID
from drivers.feetech.table import FEETECH_MODELS, FeetechDatasheet, FeetechMode, turns_wheels
from drivers.servo.joint_servo import JointServo


@dataclass(frozen=True, slots=True, kw_only=True)
class FeetechServo(JointServo):
    """Describe a FEETECH servo as the robot file declares it.

    Pulses are those that the servo shows. Its homing offset, which other software may have written
    to it, is part of them and stays as it is: an arm that LeRobot has calibrated has the middle of
    each joint at 2048, as the robot file says.
    """

    def _checks(self) -> list[tuple[bool, str]]:
        return [
            (
                not 0 <= self.id <= FEETECH_MAX_ID,
                f"id must be 0..{FEETECH_MAX_ID}, got {self.id}",
            ),
            (
                self.model_name not in FEETECH_MODELS,
                f"model must be one of {sorted(FEETECH_MODELS)}, got {self.model_name!r}",
            ),
            (
                self.wheel is not None and not turns_wheels(self.model_name),
                f"{self.model_name} has no velocity mode, and cannot turn a wheel",
            ),
            *JointServo._checks(self),
        ]

    @property
    def mode(self) -> FeetechMode:
        """Return the operating mode that the servo is used in."""
        return FeetechMode.POSITION if self.wheel is None else FeetechMode.VELOCITY

    @property
    def datasheet(self) -> FeetechDatasheet:
        """Return the control table and figures of the servo's model."""
        return FEETECH_MODELS[self.model_name]

    @property
    def pulse_rad(self) -> float:
        """Return the angle of one step."""
        return self.datasheet.step_rad

    @property
    def centre_pulse(self) -> int:
        """Return the step from which a joint's offset counts."""
        return self.datasheet.centre_step
