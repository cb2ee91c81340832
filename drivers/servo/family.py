"""Find the driver of a servo by its model's name; a family loads when it is asked for."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from importlib import import_module
from typing import Final, Protocol

from drivers.base import ByteTransport
from drivers.clock import Clock
from drivers.errors import UnknownModel
from drivers.servo.bus import ServoBusDriver
from drivers.servo.fault_policy import FaultPolicy
from drivers.servo.joint_servo import JointServo, WheelLimits
from drivers.servo.tools.bench import ServoBench


@dataclass(frozen=True, slots=True, kw_only=True)
class ServoFacts:
    """Hold what control must know of a servo model."""

    senses_current: bool
    """Its effort is the motor's current, and not the duty that is put on it."""
    full_duty_error_rad: float
    """The position error of the shaft at which the motor gives all it has, by our gains."""
    temperature_limit_c: float
    nominal_v: float
    """The voltage that the servo is made for: the datasheet's figures are of it."""
    voltage_limits_v: tuple[float, float]
    has_watchdog: bool
    """It stops by itself when the bus falls silent."""
    protocol: str
    """What is spoken on its wire: servos of one bus have the same."""
    cycle_bits: int
    """What it adds to a control cycle on the wire: its goal, and its share of the answer."""
    turns_wheels: bool = False
    """Its driver can let it turn on and on, at a speed."""


class ServoFamily(Protocol):
    """Make servos and buses of one family."""

    @property
    def name(self) -> str:
        """Return the family's name."""
        ...

    @property
    def models(self) -> Collection[str]:
        """Return the names of the models."""
        ...

    @property
    def baud_rates(self) -> Collection[int]:
        """Return the speeds that a servo can be set to, in bits per second."""
        ...

    @property
    def highest_id(self) -> int:
        """Return the highest id that a servo can have; the lowest is 0."""
        ...

    def facts(self, model: str) -> ServoFacts:
        """Return what control must know of a model."""
        ...

    def servo(
        self,
        *,
        servo_id: int,
        model_name: str,
        joint: str,
        sign: int,
        offset_rad: float,
        travel_per_rad: float,
        goal_range: tuple[float, float] | None = None,
        wheel: WheelLimits | None = None,
    ) -> JointServo:
        """Declare a servo; connecting refuses one whose own limits clip the `goal_range`.

        One with the limits of a `wheel` turns on and on. Those of a bus come last.

        Raises:
            ValueError: a value is out of its range, or the model turns no wheels.
        """
        ...

    def bus(
        self,
        transport: ByteTransport,
        clock: Clock,
        servos: Sequence[JointServo],
        *,
        baud: int,
        watchdog_s: float,
        fault_policy: FaultPolicy,
    ) -> ServoBusDriver:
        """Make a bus of servos that this family has declared; nothing is sent yet.

        Raises:
            ValueError: an id or joint twice, or the watchdog time is out of range.
        """
        ...

    def bench(self, transport: ByteTransport, clock: Clock, baud: int) -> ServoBench:
        """Take over a transport, to work on single servos without a robot file."""
        ...


FAMILIES: Final = ("dynamixel", "feetech")


def servo_family(name: str) -> ServoFamily:
    """Return a family by its name.

    Raises:
        UnknownModel: there is none of this name.
    """
    if name not in FAMILIES:
        raise UnknownModel(f"servo family: expected one of {', '.join(FAMILIES)}; got {name!r}")
    family: ServoFamily = import_module(f"drivers.{name}.family").FAMILY
    return family


def family_of(model: str) -> ServoFamily:
    """Return the family of a servo model.

    Raises:
        UnknownModel: no family has the model; the message lists those there are.
    """
    families = []
    for name in FAMILIES:
        families.append(family := servo_family(name))
        if model in family.models:
            return family
    known = "; ".join(f"{family.name}: {', '.join(sorted(family.models))}" for family in families)
    raise UnknownModel(f"servo model {model!r} is not known; there are: {known}")
