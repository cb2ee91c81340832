"""Say in what servos differ from their robot file: for connect, `servo scan` and doctor alike."""

from collections.abc import Iterable
from dataclasses import dataclass
from enum import IntEnum
from typing import Final

from drivers.servo.joint_servo import JointServo


class TroubleLevel(IntEnum):
    """Grade a trouble by what it keeps from."""

    NOTE = 0
    """The arm moves with it; it may be wanted."""
    FAULT = 1
    """Mend it before there is torque."""
    REFUSED = 2
    """The bus does not connect with it."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ServoTrouble:
    """Hold one trouble: `measured` says where, what, expected and got; `remedy` what to try."""

    measured: str
    remedy: str
    level: TroubleLevel = TroubleLevel.REFUSED

    def __str__(self) -> str:
        return f"{self.measured}; {self.remedy}"


def refusals(troubles: Iterable[ServoTrouble]) -> list[str]:
    """Return those with which a bus does not connect, a line each."""
    return [str(one) for one in troubles if one.level is TroubleLevel.REFUSED]


_SET_LIMITS: Final = "vla-deploy servo set-limits"


def limit_troubles(servo: JointServo, minimum_pulse: int, maximum_pulse: int) -> list[ServoTrouble]:
    """Return whether a servo's own position limits would clip a goal that the robot file allows."""
    if servo.goal_range is None:
        return []
    low, high = sorted(map(servo.to_pulse, servo.goal_range))
    if minimum_pulse <= low and high <= maximum_pulse:
        return []
    least, most = sorted(map(servo.to_joint, (minimum_pulse, maximum_pulse)))
    return [
        ServoTrouble(
            measured=(
                f"{servo}: expected position limits {low}..{high} or wider, as the robot file "
                f"moves it, got {minimum_pulse}..{maximum_pulse} in the servo, which clips the rest"
            ),
            remedy=(
                f"widen them with `{_SET_LIMITS} {servo.id}`, or narrow `limits` of the robot "
                f"file to {least:.3f}..{most:.3f}; where LeRobot wrote them, import its "
                "calibration first: `vla-deploy servo calibration import`"
            ),
        )
    ]
