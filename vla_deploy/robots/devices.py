"""Describe what a robot is wired to: servos, drives, sensors, button and sound."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final


@dataclass(frozen=True, slots=True, kw_only=True)
class ServoModel:
    """Give a servo model's datasheet figures at 12 V."""

    stall_torque_nm: float
    no_load_speed_rad_s: float
    mass_kg: float
    source: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Servo:
    """Tie one servo to one joint.

    joint = offset + sign * travel_per_rad * angle, where angle is 0 at the servo's centre
    (position 2048). `travel_per_rad` is 1 for a hinge and the pinion's radius in m for a finger.
    """

    id: int
    model: str
    joint: str
    sign: int
    offset: float = 0.0
    travel_per_rad: float = 1.0


@dataclass(frozen=True, slots=True, kw_only=True)
class ServoSupply:
    """Describe a power supply; `servos` are the ids of those that it feeds."""

    name: str
    voltage_v: float
    servos: tuple[int, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class ServoBus:
    """Describe the serial bus that carries every servo; their order is the joint order."""

    device: str
    path: str
    baud: int
    protocol: int = 2
    """Of Dynamixels, which is the only one that is spoken; others leave it out."""
    servos: tuple[Servo, ...]
    shadows: tuple[Servo, ...] = ()
    """Second servos of joints, which turn them together with the one in `servos`."""
    wheels: tuple[Servo, ...] = ()
    """Servos in velocity mode that turn the wheels of the base; they are no joints."""
    supplies: tuple[ServoSupply, ...] = ()
    """Each servo hangs on one of them; none are declared where one supply feeds all."""

    @property
    def all_servos(self) -> tuple[Servo, ...]:
        """Return every servo on the wire: shadows, under names of their own, then wheels last."""
        named = (replace(one, joint=shadow_name(one.joint)) for one in self.shadows)
        return (*self.servos, *named, *self.wheels)

    def supply_of(self, servo_id: int) -> ServoSupply | None:
        """Return the declared supply that feeds a servo."""
        return next((one for one in self.supplies if servo_id in one.servos), None)


def shadow_name(joint: str) -> str:
    """Return what a joint's second servo is called, and its actuator in the MJCF."""
    return f"{joint}_shadow"


@dataclass(frozen=True, slots=True, kw_only=True)
class Drive:
    """Tie one drive to one wheel: wheel speed = sign * motor speed / gear_ratio.

    `mode` and `counts_per_rev`, of the motor, are a CiA 402 drive's, `current_limit_a` an ODrive's.
    """

    node_id: int
    joint: str
    sign: int
    gear_ratio: float
    mode: str = "profile_velocity"
    counts_per_rev: int = 16384
    current_limit_a: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class CanBus:
    """Describe the CAN bus that carries the wheel drives.

    `eds_path` is the file of CiA 402 drives that are not the stack's own, `endpoints_path` the
    vendor's list of an ODrive firmware's properties.
    """

    device: str
    path: str
    bitrate: int
    protocol: str = "cia402"
    eds_path: Path | None = None
    endpoints_path: Path | None = None
    drives: tuple[Drive, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class SerialSensor:
    """Describe a sensor on a serial line; `site` names its place in the MJCF."""

    device: str
    path: str
    model: str
    site: str


@dataclass(frozen=True, slots=True, kw_only=True)
class EstopButtonDescription:
    """Describe the emergency-stop input; `number` is a key's code (HID) or a GPIO line's offset."""

    device: str
    path: str
    model: str
    number: int


@dataclass(frozen=True, slots=True, kw_only=True)
class PowerRelayDescription:
    """Describe the relay in the servos' supply; `number` is a GPIO line's offset, or a channel.

    Its board opens it by itself `hold_s` after the last pulse; None is a board without a timer. It
    gets no pulses when control has been silent for `control_silence_s`.
    """

    device: str
    path: str
    model: str
    number: int
    hold_s: float | None = None
    control_silence_s: float = 10.0

    @property
    def is_fail_safe(self) -> bool:
        """Return whether it opens where the computer dies."""
        return self.hold_s is not None


@dataclass(frozen=True, slots=True, kw_only=True)
class Audio:
    """Describe a microphone or a speaker; `path` is its name at the sound system, or a socket."""

    device: str
    path: str
    rate_hz: int
    channels: int


@dataclass(frozen=True, slots=True, kw_only=True)
class VoiceSettings:
    """Describe how the robot sounds; `voice` is one of eSpeak NG's.

    An empty `program` is the one on the PATH. `volume_ratio` is of the speaker's full scale.
    """

    voice: str = "en-gb"
    program: str = ""
    words_per_minute: int = 160
    pitch: int = 50
    volume_ratio: float = 0.8


USUAL_VOICE: Final = VoiceSettings()
