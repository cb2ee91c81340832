"""Declare one servo of a robot and its conversion between joint and pulses, for all families."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class WheelLimits:
    """Bound a servo that turns a wheel: the speed it is sent, and how fast it changes its own."""

    speed_rad_s: float
    acceleration_rad_s2: float


@dataclass(frozen=True, slots=True, kw_only=True)
class JointServo:
    """Describe a servo as the robot file declares it.

        joint value = sign * (pulse - centre_pulse) * pulse_rad * travel_per_rad + offset_rad

    `travel_per_rad` is 1 for a revolute joint; for a finger on a rack it is metres per radian,
    and then `offset_rad` and all values of this joint are in metres. What one pulse is, and where
    the horn is drawn in the datasheet, the families say.
    """

    id: int
    model_name: str
    joint: str
    sign: int = 1
    offset_rad: float = 0.0
    travel_per_rad: float = 1.0
    goal_range: tuple[float, float] | None = None
    """Between which joint values goals will lie, as the robot file limits them."""
    wheel: WheelLimits | None = None
    """Of a servo that is told speeds instead, and turns on and on."""

    def __post_init__(self) -> None:
        faults = [text for wrong, text in self._checks() if wrong]
        if faults:
            raise ValueError(f"servo {self.id} ({self.joint}): " + "; ".join(faults))

    def _checks(self) -> list[tuple[bool, str]]:
        return [
            (self.sign not in (-1, 1), f"sign must be -1 or 1, got {self.sign}"),
            (
                self.travel_per_rad <= 0,
                f"travel_per_rad must be positive, got {self.travel_per_rad}",
            ),
        ]

    @property
    def pulse_rad(self) -> float:
        """Return the angle of one pulse of the encoder."""
        raise NotImplementedError

    @property
    def centre_pulse(self) -> int:
        """Return the pulse from which a joint's offset counts."""
        raise NotImplementedError

    @property
    def joint_per_pulse(self) -> float:
        """Return the joint's signed travel per pulse."""
        return self.sign * self.pulse_rad * self.travel_per_rad

    def to_joint(self, pulse: float) -> float:
        """Return the joint value at a pulse count."""
        return (pulse - self.centre_pulse) * self.joint_per_pulse + self.offset_rad

    def to_pulse(self, joint: float) -> int:
        """Return the nearest pulse count to a joint value."""
        return round((joint - self.offset_rad) / self.joint_per_pulse) + self.centre_pulse

    def __str__(self) -> str:
        return f"servo {self.id} ({self.joint}, {self.model_name})"
