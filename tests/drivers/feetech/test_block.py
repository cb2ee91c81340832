"""The reply to a block read: the usual one is taken as it is, any other one is refused whole."""

import struct

import numpy as np
import pytest

from drivers.feetech.block import FeetechBlock
from drivers.feetech.codec import encode_packet
from drivers.feetech.servo import FeetechServo
from drivers.feetech.table import STEP_RAD
from drivers.servo.state import BusState

SERVOS = [
    FeetechServo(id=1, model_name="STS3250", joint="a"),
    FeetechServo(id=7, model_name="STS3250", joint="b", sign=-1, offset_rad=0.5),
]


def status(servo_id: int, error: int, *values: int) -> bytes:
    return encode_packet(servo_id, error, struct.pack("<HHHBBBB", *values))


USUAL = status(1, 0, 2148, 0x8000 | 50, 0x0400 | 250, 121, 40, 0, 0) + status(
    7, 0x20, 0x8000 | 12, 100, 1000, 118, 41, 0, 0x20
)


@pytest.fixture
def state() -> BusState:
    return BusState.of(2)


@pytest.fixture
def block(state: BusState) -> FeetechBlock:
    return FeetechBlock([0, 1], SERVOS, state)


def test_the_usual_reply_is_taken_in_si_with_its_signs(
    block: FeetechBlock, state: BusState
) -> None:
    assert block.take(USUAL)
    second = (2048 - -12) * STEP_RAD + 0.5
    assert state.position_rad == pytest.approx([100 * STEP_RAD, second])
    assert state.velocity_rad_s == pytest.approx([-50 * STEP_RAD, -100 * STEP_RAD])
    assert state.effort_ratio == pytest.approx([-0.25, -1.0])
    assert state.voltage_v == pytest.approx([12.1, 11.8])
    assert state.temperature_c.tolist() == [40, 41]
    assert list(block.errors) == [0, 0x20]


@pytest.mark.parametrize("at", range(len(USUAL)))
def test_one_damaged_byte_anywhere_but_between_is_refused_and_stores_nothing(
    block: FeetechBlock, state: BusState, at: int
) -> None:
    damaged = bytearray(USUAL)
    damaged[at] ^= 0x10
    assert not block.take(bytes(damaged))
    assert np.isnan(state.readings).all()


@pytest.mark.parametrize("reply", [b"", USUAL[:-1], USUAL + b"\x00", USUAL[16:] + USUAL[:16]])
def test_another_length_or_order_is_refused(block: FeetechBlock, reply: bytes) -> None:
    assert not block.take(reply)
