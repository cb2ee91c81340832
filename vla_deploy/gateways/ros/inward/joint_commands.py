"""Follow /robot_joint_commands: positions as ros2_control's topic-based hardware streams them.

Each becomes a goal of control, which limits its jerk and brings it to rest: joints follow with a
lag, and stand where the last message wanted them when the stream ends.
"""

import math
from typing import Final

from sensor_msgs.msg import JointState

from drivers.clock import NS_PER_S
from vla_deploy.client.motions import Claimed, Motions
from vla_deploy.client.readiness import refusal_of
from vla_deploy.gateways.ros.inward.refusals import Refusals
from vla_deploy.gateways.ros.part import Due, Gateway

TOPIC: Final = "/robot_joint_commands"
RATE_HZ: Final = 20.0
"""Goals for control at most so often; of what comes in between, the newest counts."""
LET_GO_S: Final = 1.0
_CHANGED: Final = 1e-4


class JointCommands:
    """Pass the newest wanted positions on while nobody else moves these joints."""

    def __init__(self, gateway: Gateway, motions: Motions) -> None:
        self._gateway = gateway
        self._motions = motions
        self._claim: Claimed | None = None
        self._claimed: frozenset[str] = frozenset()
        self._wanted: dict[str, float] = {}
        self._sent: dict[str, float] = {}
        self._motion_id: int | None = None
        self._heard_ns = 0
        self._refusals = Refusals(TOPIC, gateway.link.clock)
        self._due = Due(RATE_HZ)
        gateway.graph.listen(JointState, TOPIC, self._take)

    def step(self, now_ns: int) -> None:
        """Send what has changed; let others have the joints when the stream has ended."""
        if self._claim is not None and now_ns - self._heard_ns > LET_GO_S * NS_PER_S:
            self._let_go()
        changed = {
            joint: value
            for joint, value in self._wanted.items()
            if abs(value - self._sent.get(joint, math.inf)) > _CHANGED
        }
        if not changed or not self._due.is_now(now_ns):
            return
        why = refusal_of(self._gateway.control_status()) or self._why_not_held(changed)
        if why:
            self._wanted.clear()
            self._refusals.note(why)
            return
        if self._motion_id is not None:
            self._motions.forget(self._motion_id)
        # All that are moved from here, since a goal that loses a joint ends for its others, too.
        self._motion_id = self._motions.go(dict(self._wanted), {})
        self._sent = dict(self._wanted)

    def stop(self) -> None:
        """End the motion that is under way."""
        if self._motion_id is not None:
            self._motions.cancel(self._motion_id)
        self._let_go()

    def _take(self, message: JointState) -> None:
        limits = self._gateway.robot.limits
        if len(message.name) != len(message.position):
            self._refusals.note(f"{len(message.name)} names and {len(message.position)} positions")
            return
        unknown = [name for name in message.name if name not in limits]
        if unknown:
            self._refusals.note(f"unknown joints {', '.join(unknown[:8])}")
            return
        wanted = dict(zip(message.name, map(float, message.position), strict=True))
        for joint, value in wanted.items():
            if not limits[joint].min - 1e-6 <= value <= limits[joint].max + 1e-6:
                low, high = limits[joint].min, limits[joint].max
                self._refusals.note(f"{joint}: expected {low:g}..{high:g}, got {value}")
                return
        self._heard_ns = self._gateway.link.clock.now_ns()
        self._wanted |= wanted

    def _why_not_held(self, joints: dict[str, float]) -> str:
        """Take the groups of these joints beside those that are held; return who has them else."""
        needed = frozenset(self._gateway.robot.groups_moving(joints))
        if self._claim is not None and needed <= self._claimed:
            return ""
        if self._claim is not None:
            self._claim.release()
        self._claimed |= needed
        self._claim = Claimed(self._gateway.link, "ros/joint_commands", sorted(self._claimed))
        why = self._claim.why_not_taken()
        if why:
            self._let_go()
        return why

    def _let_go(self) -> None:
        if self._claim is not None:
            self._claim.release()
        self._claim, self._claimed = None, frozenset()
        self._wanted.clear()
        self._sent.clear()
