"""Follow what streams in on two topics: /cmd_vel for the base, /robot_joint_commands for joints.

A message on /cmd_vel holds for a moment, and nobody has to take it back. Positions come as
ros2_control's topic-based hardware streams them: each becomes a goal of control, which limits its
jerk and brings it to rest, so joints follow with a lag, and stand where the last message wanted
them when the stream ends.
"""

import logging
import math
from typing import Final

from geometry_msgs.msg import Twist, TwistStamped
from sensor_msgs.msg import JointState

from drivers.clock import NS_PER_S, Clock
from vla_deploy.client.motions import Claimed, Motions
from vla_deploy.client.readiness import refusal_of
from vla_deploy.gateways.ros.outgoing.lending import Borrowed
from vla_deploy.gateways.ros.part import Due, Gateway, GatewayPart
from vla_deploy.ipc import CellWriter, topics

CMD_VEL: Final = "/cmd_vel"
HOLDS_S: Final = 0.2
"""How long a velocity holds: two periods of a sender at 10 Hz."""
MOST_AGE_S: Final = 0.2
MOST_AHEAD_S: Final = 0.1
_REST_S: Final = 0.5
JOINT_COMMANDS: Final = "/robot_joint_commands"
RATE_HZ: Final = 20.0
"""Goals for control at most so often; of the positions that come in between, the newest count."""
LET_GO_S: Final = 1.0
_CHANGED: Final = 1e-4
REFUSALS_S: Final = 2.0
"""A stream's refusals are logged once in this time, not once for each message."""
_log = logging.getLogger(__name__)


class Velocity(GatewayPart):
    """Pass on what is wanted of the base while nobody else drives it, or the executor lends it."""

    def __init__(self, gateway: Gateway, claim: Claimed | Borrowed) -> None:
        self._gateway = gateway
        self._clock = gateway.link.clock
        self._command: CellWriter = gateway.link.space.cell_writer(topics.REMOTE_BASE_COMMAND)
        self._claim = claim
        self._last_ns = self._stamp_ns = 0
        self._refusals = _Refusals(CMD_VEL, gateway.link.clock)
        if gateway.settings.cmd_vel_stamped:
            gateway.graph.listen(TwistStamped, CMD_VEL, self._take_stamped)
        else:
            gateway.graph.listen(Twist, CMD_VEL, self._take)

    def step(self, now_ns: int) -> None:
        """Release the base when nobody drives it any more, or nobody may."""
        if self._claim.is_held and self._claim.why_over():
            self.stop()
        elif self._claim.is_held and now_ns - self._last_ns > round(_REST_S * NS_PER_S):
            self._claim.release()

    def stop(self) -> None:
        """Bring the base to rest if it is driven from here."""
        if self._claim.is_held:
            self._command.put(v_m_s=0.0, w_rad_s=0.0, valid_s=0.0)
            self._claim.release()

    def _take_stamped(self, message: TwistStamped) -> None:
        stamp, time = message.header.stamp, self._gateway.time
        if not time.is_unset(stamp):
            age_s = (self._clock.now_ns() - time.run_ns(stamp)) / NS_PER_S
            if not -MOST_AHEAD_S <= age_s <= MOST_AGE_S:
                hint = "; do both go by the same time (use_sim_time)?" if abs(age_s) > 5 else ""
                self._refusals.note(
                    f"its stamp is {age_s:.2f} s old, expected 0 to {MOST_AGE_S}{hint}"
                )
                return
            if time.run_ns(stamp) < self._stamp_ns:
                self._refusals.note("its stamp is older than that of the one before")
                return
            self._stamp_ns = time.run_ns(stamp)
        self._take(message.twist)

    def _take(self, twist: Twist) -> None:
        parts = (
            *(twist.linear.x, twist.linear.y, twist.linear.z),
            *(twist.angular.x, twist.angular.y, twist.angular.z),
        )
        if not all(map(math.isfinite, parts)):
            self._refusals.note("it holds numbers that are not finite")
            return
        base = self._gateway.robot.parts.base
        sideways = base is not None and base.is_holonomic
        left_m_s = float(twist.linear.y) if sideways else 0.0
        if any((twist.linear.y - left_m_s, twist.linear.z, twist.angular.x, twist.angular.y)):
            along = "along x and y" if sideways else "along x"
            self._refusals.note(f"this base moves {along} and turns about z only")
            return
        why = refusal_of(self._gateway.control_status()) or self._claim.why_not_taken()
        if why:
            self._refusals.note(why)
            return
        self._last_ns = self._clock.now_ns()
        v_m_s, w_rad_s = float(twist.linear.x), float(twist.angular.z)
        # All by the same ratio: the curve stays.
        speed_m_s = math.hypot(v_m_s, left_m_s)
        ratio = min(1.0, self._claim.most_m_s() / speed_m_s) if speed_m_s else 1.0
        self._command.put(
            v_m_s=v_m_s * ratio,
            w_rad_s=w_rad_s * ratio,
            left_m_s=left_m_s * ratio,
            valid_s=HOLDS_S,
        )


class JointCommands(GatewayPart):
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
        self._refusals = _Refusals(JOINT_COMMANDS, gateway.link.clock)
        self._due = Due(RATE_HZ)
        gateway.graph.listen(JointState, JOINT_COMMANDS, self._take)

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
        """Take the groups of these joints with those that are held; return who has them else."""
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


class _Refusals:
    """Log refusals of one topic, at most one every `REFUSALS_S`."""

    def __init__(self, topic: str, clock: Clock) -> None:
        self._topic = topic
        self._clock = clock
        self._logged_ns: int | None = None

    def note(self, why: str) -> None:
        """Log a refusal, unless one was logged just before."""
        now_ns = self._clock.now_ns()
        if self._logged_ns is None or now_ns - self._logged_ns > REFUSALS_S * NS_PER_S:
            self._logged_ns = now_ns
            _log.warning("%s refused: %s", self._topic, why)
