"""Declare one servo of a robot and its conversion between joint and pulses."""

from dataclasses import dataclass

from drivers.dynamixel.tables.control_table import (
    CENTRE_PULSE,
    MODELS,
    PULSE_RAD,
    OperatingMode,
    ServoDatasheet,
)
from drivers.dynamixel.wire.codec import MAX_SERVO_ID


@dataclass(frozen=True, slots=True, kw_only=True)
class ServoSpec:
    """Describe a servo as the robot file declares it.

        joint value = sign * (pulse - 2048) * 2 pi / 4096 * travel_per_rad + offset_rad

    `travel_per_rad` is 1 for a revolute joint; for a finger on a rack it is metres per radian,
    and then `offset_rad` and all values of this joint are in metres.
    """

    id: int
    model_name: str
    joint: str
    sign: int = 1
    offset_rad: float = 0.0
    travel_per_rad: float = 1.0
    operating_mode: OperatingMode = OperatingMode.POSITION

    def __post_init__(self) -> None:
        faults = [text for wrong, text in self._checks() if wrong]
        if faults:
            raise ValueError(f"servo {self.id} ({self.joint}): " + "; ".join(faults))

    def _checks(self) -> list[tuple[bool, str]]:
        known = self.model_name in MODELS
        return [
            (not 0 <= self.id <= MAX_SERVO_ID, f"id must be 0..{MAX_SERVO_ID}, got {self.id}"),
            (not known, f"model must be one of {sorted(MODELS)}, got {self.model_name!r}"),
            (self.sign not in (-1, 1), f"sign must be -1 or 1, got {self.sign}"),
            (
                self.travel_per_rad <= 0,
                f"travel_per_rad must be positive, got {self.travel_per_rad}",
            ),
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
    def joint_per_pulse(self) -> float:
        """Return the joint's signed travel per pulse."""
        return self.sign * PULSE_RAD * self.travel_per_rad

    def to_joint(self, pulse: float) -> float:
        """Return the joint value at a pulse count."""
        return (pulse - CENTRE_PULSE) * self.joint_per_pulse + self.offset_rad

    def to_pulse(self, joint: float) -> int:
        """Return the nearest pulse count to a joint value."""
        return round((joint - self.offset_rad) / self.joint_per_pulse) + CENTRE_PULSE

    def __str__(self) -> str:
        return f"servo {self.id} ({self.joint}, {self.model_name})"
