"""Send motions to control as the executor does, and learn how each ended; hold their parts."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from vla_deploy.client.link import RobotLink
from vla_deploy.ipc import ClaimBook, topics
from vla_deploy.ipc.errors import ClaimRefused
from vla_deploy.ipc.motion_ids import motion_ids, sender_of
from vla_deploy.ipc.payloads.motion import CancelMotion, GoalMotion, TrajectoryMotion

Floats = NDArray[np.float64]
GRIPPER_EFFORT_RATIO: Final = 0.5
"""A gripper presses on what it holds for as long as it is told to close: LeRobot gives it half its
torque, too (so_follower.py: Max_Torque_Limit 500)."""
_JOINT_AGE_S: Final = 0.25


@dataclass(frozen=True, slots=True, kw_only=True)
class Ended:
    """Describe how a motion ended: done, touched, cancelled, refused, stopped, and why."""

    status: str
    reason: str


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class JointView:
    """Hold what control told of some joints at one moment, in their order."""

    stamp_ns: int
    position: Floats
    velocity: Floats
    setpoint: Floats
    effort_ratio: Floats


def joint_view(
    link: RobotLink, joint_index: Mapping[str, int], joints: Sequence[str]
) -> JointView | None:
    """Return how some joints are, or None where control is silent."""
    sample = link.fresh(topics.JOINT_STATE, _JOINT_AGE_S)
    if sample is None:
        return None
    chosen = [joint_index[joint] for joint in joints]

    def of(field: str) -> Floats:
        return np.asarray(sample.data[field], dtype=np.float64)[chosen]

    return JointView(
        stamp_ns=sample.stamp_ns,
        position=of("position"),
        velocity=of("velocity"),
        setpoint=of("setpoint"),
        effort_ratio=of("effort_ratio"),
    )


class Motions:
    """Hold one sender's end of the topics of motions."""

    def __init__(self, link: RobotLink, joint_index: Mapping[str, int], sender: str) -> None:
        self._link = link
        self._index = joint_index
        self._sender = sender
        self._ids = motion_ids(link.clock, sender)
        self._results = link.events(topics.MOTION_RESULT)
        self._ended: dict[int, Ended] = {}
        self._active: set[int] = set()

    def step(self) -> None:
        """Take in what has ended."""
        for event in self._results.drain():
            told = event.payload
            if told["motion_id"] in self._active:
                self._active.remove(told["motion_id"])
                self._ended[told["motion_id"]] = Ended(status=told["status"], reason=told["reason"])

    def follow(self, joints: Sequence[str], times_s: Floats, positions: Floats) -> int:
        """Ask control to pass timed points, and return the motion's id.

        Raises:
            BadPayload: it is longer than control takes.
        """
        return self._send(
            {
                "kind": "trajectory",
                "motion_id": next(self._ids),
                "joints": list(joints),
                "times_s": np.round(times_s, 6).tolist(),
                "positions": np.round(positions, 6).tolist(),
            }
        )

    def go(
        self,
        targets: Mapping[str, float],
        effort_ratio: Mapping[str, float],
        speed_ratio: float = 1.0,
        *,
        together: bool = True,
    ) -> int:
        """Ask control to bring joints to targets, and return the motion's id.

        Unless `together`, each joint arrives as early as it can.
        """
        command: GoalMotion = {
            "kind": "goal",
            "motion_id": next(self._ids),
            "targets": dict(targets),
            "speed_ratio": speed_ratio,
            "effort_ratio": dict(effort_ratio),
        }
        if not together:
            command["together"] = False
        return self._send(command)

    def cancel(self, motion_id: int) -> None:
        """Ask control to end a motion, its joints on a ramp; its result follows."""
        cancel: CancelMotion = {"kind": "cancel", "motion_id": motion_id}
        self._link.writer(topics.MOTION_COMMAND).publish(cancel)

    def forget(self, motion_id: int) -> None:
        """Take no more interest in how a motion ends."""
        self._active.discard(motion_id)
        self._ended.pop(motion_id, None)

    def ended(self, motion_id: int) -> Ended | None:
        """Return how a motion ended, once, or None while it goes on."""
        return self._ended.pop(motion_id, None)

    def look(self, joints: Sequence[str]) -> JointView | None:
        """Return how some joints are, or None where control is silent."""
        return joint_view(self._link, self._index, joints)

    def close(self) -> None:
        """End every motion that was begun here."""
        for motion_id in self._active:
            self.cancel(motion_id)
        self._results.close()

    def end_those_of_one_before(self) -> None:
        """End motions whose sender was killed: nobody watches over them any more."""
        status = self._link.document(topics.CONTROL_STATUS, _JOINT_AGE_S)
        for motion_id in () if status is None else status["active_motions"]:
            if sender_of(motion_id) == self._sender:
                self.cancel(motion_id)

    def _send(self, command: GoalMotion | TrajectoryMotion) -> int:
        self._link.writer(topics.MOTION_COMMAND).publish(command)
        self._active.add(command["motion_id"])
        return command["motion_id"]


class Claimed:
    """Ask for some of the robot's parts, all or none; waiting for them is not offered."""

    def __init__(self, link: RobotLink, holder: str, parts: Sequence[str]) -> None:
        self.is_held = False
        self._book = ClaimBook(link.space, link.clock)
        self._holder = holder
        self._wants = dict.fromkeys(parts, 1)

    def why_not_taken(self) -> str:
        """Take them, or return who has them; holding them already is fine."""
        if self.is_held:
            return ""
        try:
            self.is_held = self._book.ask(self._holder, self._wants)
        except ClaimRefused as error:
            return str(error)
        if self.is_held:
            return ""
        self._book.release(self._holder)
        return self._book.obstacles(self._wants) or "another command was faster"

    def why_over(self) -> str:
        """Return "": what is held is held until it is released."""
        return ""

    def most_m_s(self) -> float:
        """Return infinity: the limits are control's."""
        return math.inf

    def release(self) -> None:
        """Give them back."""
        self._book.release(self._holder)
        self.is_held = False
