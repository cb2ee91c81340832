"""Find out why FEETECH servos do not answer what is asked of many at once."""

from collections.abc import Sequence
from typing import Final

from drivers.errors import DriverError
from drivers.feetech.checks import read_head, wrong_model
from drivers.feetech.link import FeetechLink
from drivers.feetech.servo import FeetechServo
from drivers.feetech.table import FEETECH_BAUD_RATES, models_of
from drivers.servo.baud_search import speed_remedy, where_they_answer
from drivers.servo.errors import CorruptReply, ServoSilent, WrongServo
from drivers.servo.patience import ReplyPatience

SILENCE_REMEDY: Final = (
    "check power, cable, id and speed (a supply of another voltage than the servo's version "
    "silences it, too)"
)
_ONCE: Final = ReplyPatience(margin_s=0.02, attempts=1)


def silence_error(link: FeetechLink, silent: Sequence[FeetechServo]) -> DriverError:
    """Return what to raise for servos that gave no whole answer, each asked by itself.

    Raises:
        LinkLost: the adapter is gone.
    """
    damaged, others = [], []
    for servo in silent:
        try:
            others.append(_lone_answer(servo, read_head(link, servo)))
        except CorruptReply as error:
            damaged.append(str(error))
        except ServoSilent:
            continue
    if damaged:
        return CorruptReply("\n".join(damaged))
    if others:
        return WrongServo("\n".join(others))
    names = ", ".join(map(str, silent))
    found = where_they_answer(
        link, silent, FEETECH_BAUD_RATES.values(), lambda servo: read_head(link, servo, _ONCE)
    )
    remedy = speed_remedy(found, link.baud) if found else SILENCE_REMEDY
    return ServoSilent(f"no answer from {names}; {remedy}")


def _lone_answer(servo: FeetechServo, head: bytes) -> str:
    """Return what is wrong with a servo that answers alone, but not among others."""
    if models_of(head[3:5])[1] != servo.datasheet.number:
        return str(wrong_model(servo, head))
    return (
        f"{servo}: answers alone, but not to a sync read; its firmware is {head[0]}.{head[1]}, "
        "expected 3.10 or newer; look for a second servo of this id, too, at cable and supply"
    )
