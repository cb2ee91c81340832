"""Read what servos sense, in units, from their registers."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

from drivers.dynamixel.servo import ServoSpec
from drivers.dynamixel.tables.control_table import CENTRE_PULSE, PULSE_RAD, VOLTAGE_UNIT_V
from drivers.dynamixel.tables.registers import decode
from drivers.dynamixel.tools.bench_link import THREE_TRIES, BenchLink
from drivers.servo.fault_policy import describe_bits

_STATUS: Final = (64, 7)  # torque_enable .. hardware_error_status
_SENSED: Final = (124, 23)  # present_pwm .. present_temperature


@dataclass(frozen=True, slots=True, kw_only=True)
class ServoReading:
    """Hold what one servo sensed; angles are of the servo, 0 at pulse 2048."""

    id: int
    joint: str
    model: str
    position_rad: float
    velocity_rad_s: float
    effort: float
    effort_unit: str
    voltage_v: float
    temperature_c: int
    torque_on: bool
    errors: str


def read_servos(
    link: BenchLink, servos: Sequence[ServoSpec], joints: Mapping[int, str]
) -> list[ServoReading]:
    """Return the readings of the servos that answer; the link counts what goes wrong.

    `joints` names joints by servo id; "" is the joint of a servo that is not in it.

    Raises:
        LinkLost: the adapter is gone.
    """
    statuses = link.registers.read_span_many(servos, *_STATUS, THREE_TRIES)
    spans = link.registers.read_span_many(servos, *_SENSED, THREE_TRIES)
    return [
        _reading(servo, statuses[servo.id], spans[servo.id], joints.get(servo.id, ""))
        for servo in servos
        if servo.id in statuses and servo.id in spans
    ]


def _reading(servo: ServoSpec, status: bytes, span: bytes, joint: str) -> ServoReading:
    model, start = servo.model, _SENSED[0]
    has_current = model.current_unit_a is not None
    effort = decode(servo, span, start, "present_current" if has_current else "present_load")
    return ServoReading(
        id=servo.id,
        joint=joint,
        model=model.name,
        position_rad=(decode(servo, span, start, "present_position") - CENTRE_PULSE) * PULSE_RAD,
        velocity_rad_s=decode(servo, span, start, "present_velocity") * model.velocity_unit_rad_s,
        effort=effort * (model.current_unit_a or 0.1),
        effort_unit="A" if has_current else "%",
        voltage_v=decode(servo, span, start, "present_input_voltage") * VOLTAGE_UNIT_V,
        temperature_c=decode(servo, span, start, "present_temperature"),
        torque_on=bool(decode(servo, status, _STATUS[0], "torque_enable")),
        errors=describe_bits(decode(servo, status, _STATUS[0], "hardware_error_status")),
    )
