"""Drive the base by /cmd_vel: each message holds for a moment, and nobody has to take it back."""

import math
from typing import Final

from geometry_msgs.msg import Twist, TwistStamped

from drivers.clock import NS_PER_S
from vla_deploy.client.readiness import refusal_of
from vla_deploy.gateways.ros.inward.claiming import PartsHold
from vla_deploy.gateways.ros.inward.refusals import Refusals
from vla_deploy.gateways.ros.part import Gateway
from vla_deploy.ipc import CellWriter, topics

TOPIC: Final = "/cmd_vel"
HOLDS_S: Final = 0.2
"""How long a message holds: two periods of a sender at 10 Hz."""
MOST_AGE_S: Final = 0.2
MOST_AHEAD_S: Final = 0.1
_REST_S: Final = 0.5


class Velocity:
    """Pass on what is wanted of the base while nobody else drives it, or the executor lends it."""

    def __init__(self, gateway: Gateway, claim: PartsHold) -> None:
        self._gateway = gateway
        self._clock = gateway.link.clock
        self._command: CellWriter = gateway.link.space.cell_writer(topics.REMOTE_BASE_COMMAND)
        self._claim = claim
        self._last_ns = self._stamp_ns = 0
        self._refusals = Refusals(TOPIC, gateway.link.clock)
        if gateway.settings.cmd_vel_stamped:
            gateway.graph.listen(TwistStamped, TOPIC, self._take_stamped)
        else:
            gateway.graph.listen(Twist, TOPIC, self._take)

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
        if any((twist.linear.y, twist.linear.z, twist.angular.x, twist.angular.y)):
            self._refusals.note("this base moves along x and turns about z only")
            return
        why = refusal_of(self._gateway.control_status()) or self._claim.why_not_taken()
        if why:
            self._refusals.note(why)
            return
        self._last_ns = self._clock.now_ns()
        v_m_s, w_rad_s = float(twist.linear.x), float(twist.angular.z)
        # Both by the same ratio: the curve stays.
        ratio = min(1.0, self._claim.most_m_s() / abs(v_m_s)) if v_m_s else 1.0
        self._command.put(v_m_s=v_m_s * ratio, w_rad_s=w_rad_s * ratio, valid_s=HOLDS_S)
