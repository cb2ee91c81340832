"""Find out whether silent servos would answer at another speed."""

from collections.abc import Sequence
from typing import Final

from drivers.dynamixel.servo import ServoSpec
from drivers.dynamixel.tables.control_table import BAUD_RATES
from drivers.dynamixel.tables.registers import Registers
from drivers.errors import NoReply, ProtocolError
from drivers.servo.patience import ReplyPatience

_ONCE: Final = ReplyPatience(margin_s=0.02, attempts=1)


def where_they_answer(registers: Registers, silent: Sequence[ServoSpec]) -> dict[int, int]:
    """Return the speed by servo id of those that answer a ping at another; the speed is put back.

    Raises:
        LinkLost: the adapter is gone.
    """
    link = registers.link
    wanted = link.baud
    found: dict[int, int] = {}
    try:
        for baud in link.other_bauds:
            if baud in BAUD_RATES.values():
                link.set_baud(baud)
                found |= {servo.id: baud for servo in silent if _answers(registers, servo)}
    finally:
        link.set_baud(wanted)
    return found


def _answers(registers: Registers, servo: ServoSpec) -> bool:
    try:
        registers.ping(servo, _ONCE)
    except (NoReply, ProtocolError):
        return False
    return True
