"""Offer Dynamixel X servos to those who do not care which family a servo is of."""

from collections.abc import Collection, Sequence
from typing import Final, cast

from drivers.base import ByteTransport
from drivers.clock import Clock
from drivers.dynamixel.bus import DynamixelBus
from drivers.dynamixel.servo import ServoSpec
from drivers.dynamixel.tables.control_table import (
    BAUD_RATES,
    MODELS,
    PULSE_RAD,
    PWM_FULL,
    VOLTAGE_UNIT_V,
)
from drivers.dynamixel.tools.bench import DynamixelBench
from drivers.dynamixel.torque import HOLD_GAINS
from drivers.dynamixel.wire.codec import MAX_SERVO_ID
from drivers.servo.family import ServoFacts
from drivers.servo.fault_policy import FaultPolicy
from drivers.servo.joint_servo import JointServo, WheelLimits

FULL_DUTY_ERROR_RAD: Final = PWM_FULL * 128.0 / HOLD_GAINS["position_p_gain"] * PULSE_RAD
"""e-manual: duty in PWM units is the error in pulses times P / 128."""
_CYCLE_BITS: Final = 300
"""One sync write and one fast sync read, by the servo."""


class DynamixelFamily:
    """Make Dynamixel servos and buses."""

    name: Final = "dynamixel"
    highest_id: Final = MAX_SERVO_ID

    @property
    def models(self) -> Collection[str]:
        """Return the names of the models."""
        return MODELS

    @property
    def baud_rates(self) -> Collection[int]:
        """Return the speeds that a servo can be set to, in bits per second."""
        return BAUD_RATES.values()

    def facts(self, model: str) -> ServoFacts:
        """Return what control must know of a model; limits are the factory's."""
        sheet = MODELS[model]

        def initial(name: str) -> int:
            value = sheet.registers[name].initial
            assert value is not None, f"{model}: {name} has no factory value"
            return value

        return ServoFacts(
            senses_current=sheet.current_unit_a is not None,
            full_duty_error_rad=FULL_DUTY_ERROR_RAD,
            temperature_limit_c=float(initial("temperature_limit")),
            nominal_v=sheet.voltage_v,
            voltage_limits_v=(
                initial("min_voltage_limit") * VOLTAGE_UNIT_V,
                initial("max_voltage_limit") * VOLTAGE_UNIT_V,
            ),
            has_watchdog=True,
            protocol="dynamixel 2",
            cycle_bits=_CYCLE_BITS,
        )

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
    ) -> ServoSpec:
        """Declare a servo; this driver lets none turn a wheel.

        Raises:
            ValueError: a value is out of its range, or it is to turn a wheel.
        """
        if wheel is not None:
            raise ValueError(f"servo {servo_id} ({joint}): this driver turns no wheels")
        return ServoSpec(
            id=servo_id,
            model_name=model_name,
            joint=joint,
            sign=sign,
            offset_rad=offset_rad,
            travel_per_rad=travel_per_rad,
            goal_range=goal_range,
        )

    def bus(
        self,
        transport: ByteTransport,
        clock: Clock,
        servos: Sequence[JointServo],
        *,
        baud: int,
        watchdog_s: float,
        fault_policy: FaultPolicy,
    ) -> DynamixelBus:
        """Make a bus whose servos hold with `HOLD_GAINS`; nothing is sent yet.

        Raises:
            ValueError: an id or joint twice, or the watchdog time is out of range.
        """
        return DynamixelBus(
            transport,
            clock,
            cast("Sequence[ServoSpec]", servos),
            baud=baud,
            watchdog_s=watchdog_s,
            hold_gains=HOLD_GAINS,
            fault_policy=fault_policy,
        )

    def bench(self, transport: ByteTransport, clock: Clock, baud: int) -> DynamixelBench:
        """Take over a transport, to work on single servos without a robot file."""
        return DynamixelBench(transport, clock, baud)


FAMILY: Final = DynamixelFamily()
