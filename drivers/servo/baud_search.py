"""Find out whether silent servos would answer at another speed."""

from collections.abc import Callable, Collection, Sequence
from typing import TypeVar

from drivers.errors import NoReply, ProtocolError
from drivers.servo.joint_servo import JointServo
from drivers.servo.wire import Wire

S = TypeVar("S", bound=JointServo)


def where_they_answer(
    wire: Wire, silent: Sequence[S], bauds: Collection[int], ask: Callable[[S], object]
) -> dict[int, int]:
    """Return the speed by servo id of those that answer `ask` at another; the speed is put back.

    Raises:
        LinkLost: the adapter is gone.
    """
    wanted = wire.baud
    found: dict[int, int] = {}
    try:
        for baud in wire.other_bauds:
            if baud in bauds:
                wire.set_baud(baud)
                found |= {servo.id: baud for servo in silent if _answers(servo, ask)}
    finally:
        wire.set_baud(wanted)
    return found


def speed_remedy(found: dict[int, int], wanted: int) -> str:
    """Return what to do about servos that answer at other speeds."""
    return "; ".join(
        f"servo {servo_id} answers at {baud} baud: set it to {wanted} "
        f"(`vla-deploy servo set-baud {wanted} {servo_id} --baud {baud}`), or correct the robot "
        "file"
        for servo_id, baud in found.items()
    )


def _answers(servo: S, ask: Callable[[S], object]) -> bool:
    try:
        ask(servo)
    except (NoReply, ProtocolError):
        return False
    return True
