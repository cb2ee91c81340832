"""Offer FEETECH servos to those who do not care which family a servo is of."""

from collections.abc import Collection, Sequence
from typing import Final, cast

from drivers.base import ByteTransport
from drivers.clock import Clock
from drivers.feetech.bus import FeetechBus
from drivers.feetech.codec import FEETECH_MAX_ID
from drivers.feetech.servo import FeetechServo
from drivers.feetech.table import (
    FEETECH_BAUD_RATES,
    FEETECH_MODELS,
    FEETECH_VOLTAGE_UNIT_V,
    turns_wheels,
)
from drivers.feetech.tools.bench import FeetechBench
from drivers.feetech.torque import HOLD_GAINS
from drivers.servo.family import ServoFacts
from drivers.servo.fault_policy import FaultPolicy
from drivers.servo.joint_servo import JointServo, WheelLimits

FULL_DUTY_STEPS_AT_GAIN_1: Final = 1600.0
"""Full duty is reached at this error divided by P.

From an STS3215-C018 that rested some 25 steps below its goal under half of its stall torque with
the factory's P of 32; the vendor's tables do not say it.
"""
_CYCLE_BITS: Final = 220
"""Its id in the request, its status of 16 bytes and its goal of 3, and a gap before it answers."""
_SINGLE_CYCLE_BITS: Final = 300
"""The same with a request of its own."""


class FeetechFamily:
    """Make FEETECH servos and buses."""

    name: Final = "feetech"
    highest_id: Final = FEETECH_MAX_ID

    @property
    def models(self) -> Collection[str]:
        """Return the names of the models."""
        return FEETECH_MODELS

    @property
    def baud_rates(self) -> Collection[int]:
        """Return the speeds that a servo can be set to, in bits per second."""
        return FEETECH_BAUD_RATES.values()

    def facts(self, model: str) -> ServoFacts:
        """Return what control must know of a model."""
        sheet = FEETECH_MODELS[model]
        steps = FULL_DUTY_STEPS_AT_GAIN_1 / HOLD_GAINS["position_p_gain"]
        return ServoFacts(
            senses_current=False,
            full_duty_error_rad=steps * sheet.step_rad,
            temperature_limit_c=float(sheet.registers["temperature_limit"].initial),
            nominal_v=sheet.voltage_v,
            voltage_limits_v=(
                9.0 if sheet.voltage_v > 9.0 else sheet.voltage_range_v[0],
                sheet.registers["max_voltage_limit"].initial * FEETECH_VOLTAGE_UNIT_V,
            ),
            has_watchdog=False,
            protocol=f"feetech {sheet.byte_order}-endian",
            cycle_bits=_CYCLE_BITS if sheet.has_sync_read else _SINGLE_CYCLE_BITS,
            turns_wheels=turns_wheels(model),
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
    ) -> FeetechServo:
        """Declare a servo; one with the limits of a `wheel` is used in velocity mode.

        Raises:
            ValueError: a value is out of its range.
        """
        return FeetechServo(
            id=servo_id,
            model_name=model_name,
            joint=joint,
            sign=sign,
            offset_rad=offset_rad,
            travel_per_rad=travel_per_rad,
            goal_range=goal_range,
            wheel=wheel,
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
    ) -> FeetechBus:
        """Make a bus; nothing is sent yet. There is no watchdog to set to `watchdog_s`.

        Raises:
            ValueError: an id or joint twice, or servos of both byte orders.
        """
        del watchdog_s
        return FeetechBus(
            transport,
            clock,
            cast("Sequence[FeetechServo]", servos),
            baud=baud,
            fault_policy=fault_policy,
        )

    def bench(self, transport: ByteTransport, clock: Clock, baud: int) -> FeetechBench:
        """Take over a transport, to work on single servos without a robot file."""
        return FeetechBench(transport, clock, baud)


FAMILY: Final = FeetechFamily()
