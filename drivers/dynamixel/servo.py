"""Declare one Dynamixel of a robot."""

from dataclasses import dataclass

from drivers.dynamixel.tables.control_table import (
    CENTRE_PULSE,
    MODELS,
    PULSE_RAD,
    OperatingMode,
    ServoDatasheet,
)
from drivers.dynamixel.wire.codec import MAX_SERVO_ID
from drivers.servo.joint_servo import JointServo


@dataclass(frozen=True, slots=True, kw_only=True)
class ServoSpec(JointServo):
    """Describe a Dynamixel as the robot file declares it; 4096 pulses are a turn."""

    operating_mode: OperatingMode = OperatingMode.POSITION

    def _checks(self) -> list[tuple[bool, str]]:
        known = self.model_name in MODELS
        return [
            (not 0 <= self.id <= MAX_SERVO_ID, f"id must be 0..{MAX_SERVO_ID}, got {self.id}"),
            (not known, f"model must be one of {sorted(MODELS)}, got {self.model_name!r}"),
            *JointServo._checks(self),
            (
                known and self.operating_mode not in self.model.operating_modes,
                f"{self.model_name} has no operating mode {self.operating_mode.name}",
            ),
        ]

    @property
    def model(self) -> ServoDatasheet:
        """Return the control table of the servo's model."""
        return MODELS[self.model_name]

    @property
    def pulse_rad(self) -> float:
        """Return the angle of one pulse."""
        return PULSE_RAD

    @property
    def centre_pulse(self) -> int:
        """Return the pulse at which the horn is drawn in the datasheet."""
        return CENTRE_PULSE
