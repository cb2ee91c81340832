"""Decide what the hands hold: the executor reports it, the fingers confirm or deny it."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from drivers.clock import NS_PER_S
from vla_deploy.ipc import Sample
from vla_deploy.ipc.payloads.scene import HandDocument
from vla_deploy.perception.naming.classes import OTHER
from vla_deploy.robots import RobotDescription
from vla_deploy.world.touch import FingerSample, Grip, Touch, feel

# Older samples of the fingers are not used.
STALE_NS = NS_PER_S // 4


@dataclass(frozen=True, slots=True, kw_only=True)
class Hold:
    """Hold what a hand holds: `kind` is a class, "" for nothing; `cause` why it no longer does.

    `reported` is the class that the executor names.
    """

    kind: str
    reported: str
    touch: Touch
    is_confirmed: bool
    cause: str = ""

    @property
    def is_lost(self) -> bool:
        """Return whether the hand lost what it was to hold, rather than putting it down."""
        return not self.kind and self.touch.grip is Grip.LOST

    def document(self, holding: str | None) -> HandDocument:
        """Return it for the scene topic; `holding` is the id of what is held."""
        return {
            "holding": holding,
            "class": self.kind or None,
            "told": self.reported or None,
            "felt": self.touch.grip.value,
            "confirmed": self.is_confirmed,
            "width_m": round(self.touch.width_m, 4) if self.touch.is_held else None,
            "drift_m": round(self.touch.drift_m, 4),
            "effort_ratio": round(self.touch.closing_ratio, 3),
            "cause": self.cause,
        }


class Hands:
    """Follow the fingers of every hand in control's joint states."""

    def __init__(self, robot: RobotDescription) -> None:
        index = robot.joint_index
        self._grippers = {
            name: (index[hand.gripper], hand.opening_ratio) for name, hand in robot.hands.items()
        }
        self._touches = {name: Touch() for name in robot.hands}
        self._stamp_ns = 0

    def update(self, sample: Sample) -> None:
        """Process a sample of `joint_state`, once."""
        if sample.stamp_ns <= self._stamp_ns:
            return
        self._stamp_ns, data = sample.stamp_ns, sample.data
        for name, (joint, ratio) in self._grippers.items():
            fingers = FingerSample(
                stamp_ns=sample.stamp_ns,
                opening_m=ratio * float(data["position"][joint]),
                goal_m=ratio * float(data["setpoint"][joint]),
                speed_m_s=ratio * float(data["velocity"][joint]),
                closing_ratio=-float(data["effort_ratio"][joint]),
                is_powered=bool(data["torque_enabled"][joint]),
            )
            self._touches[name] = feel(self._touches[name], fingers)

    def holds(self, reported: Mapping[str, Any], now_ns: int) -> dict[str, Hold]:
        """Return what each hand holds; `reported` is what the executor names, by hand."""
        is_felt = now_ns - self._stamp_ns <= STALE_NS
        return {
            name: _hold(str(reported.get(name) or ""), touch if is_felt else Touch())
            for name, touch in self._touches.items()
        }


def _hold(reported: str, touch: Touch) -> Hold:
    """Join report and touch: what is not felt is not held, what is only felt has no class."""
    kind, cause, is_confirmed = "", touch.cause, True
    if touch.is_held:
        kind, cause = reported or OTHER, ""
    elif touch.grip in (Grip.UNKNOWN, Grip.CLOSING):
        kind, is_confirmed = reported, False
    elif reported and not cause:
        cause = "nothing is felt between the fingers"
    return Hold(kind=kind, reported=reported, touch=touch, is_confirmed=is_confirmed, cause=cause)
