"""Bring the base from its present velocity to the wanted one, no faster than it can bear."""

from collections.abc import Collection
from dataclasses import dataclass
from math import hypot

from vla_deploy.control.motion.base_velocity import STANDING, BaseVelocity
from vla_deploy.robots import RobotDescription
from vla_deploy.safety import Direction


@dataclass(frozen=True, slots=True, kw_only=True)
class BaseLimits:
    """Carry the base's largest speeds and accelerations."""

    speed_m_s: float
    turn_rad_s: float
    acceleration_m_s2: float
    turn_acceleration_rad_s2: float
    stop_deceleration_m_s2: float

    @property
    def brake_ratio(self) -> float:
        """Return how much harder it brakes where it must stop than it speeds up."""
        return max(1.0, self.stop_deceleration_m_s2 / self.acceleration_m_s2)

    @property
    def slowing_s(self) -> float:
        """Return how long it slows down from its top speeds; a base that is not there stands."""
        if not self.acceleration_m_s2:
            return 0.0
        return max(
            self.speed_m_s / self.acceleration_m_s2,
            self.turn_rad_s / self.turn_acceleration_rad_s2,
        )

    @property
    def braking_s(self) -> float:
        """Return the same where it must stop."""
        return self.slowing_s / self.brake_ratio if self.slowing_s else 0.0


def base_limits(robot: RobotDescription) -> BaseLimits:
    """Return what the robot file allows the base; none may move where there is none."""
    base = robot.parts.base
    if base is None:
        return BaseLimits(
            speed_m_s=0.0,
            turn_rad_s=0.0,
            acceleration_m_s2=0.0,
            turn_acceleration_rad_s2=0.0,
            stop_deceleration_m_s2=0.0,
        )
    return BaseLimits(
        speed_m_s=base.max_speed_m_s,
        turn_rad_s=base.max_turn_rad_s,
        acceleration_m_s2=base.max_acceleration_m_s2,
        turn_acceleration_rad_s2=base.max_turn_acceleration_rad_s2,
        stop_deceleration_m_s2=base.stop_deceleration_m_s2 or base.max_acceleration_m_s2,
    )


class BaseRamp:
    """Hold the base velocity that is being commanded."""

    def __init__(self, limits: BaseLimits) -> None:
        self.velocity = STANDING
        self._limits = limits

    @property
    def v_m_s(self) -> float:
        """Return the commanded velocity ahead."""
        return self.velocity.v_m_s

    @property
    def w_rad_s(self) -> float:
        """Return the commanded turning velocity."""
        return self.velocity.w_rad_s

    @property
    def at_rest(self) -> bool:
        """Return whether the commanded velocity is zero."""
        return self.velocity == STANDING

    def advance(self, v_m_s: float, w_rad_s: float, period_s: float, left_m_s: float = 0.0) -> None:
        """Move towards a wanted velocity for one period; all parts reach it together."""
        limits = self._limits
        speed_m_s = hypot(v_m_s, left_m_s)
        if left_m_s and speed_m_s > limits.speed_m_s:
            v_m_s *= limits.speed_m_s / speed_m_s
            left_m_s *= limits.speed_m_s / speed_m_s
        wanted = BaseVelocity(
            _clamp(v_m_s, limits.speed_m_s), _clamp(w_rad_s, limits.turn_rad_s), left_m_s
        )
        self._move(wanted, 1.0, period_s)

    def brake(self, period_s: float) -> None:
        """Move towards rest for one period, as fast as the robot can bear where it must stop."""
        self._move(STANDING, self._limits.brake_ratio, period_s)

    def _move(self, wanted: BaseVelocity, harder: float, period_s: float) -> None:
        limits, before = self._limits, self.velocity
        dv, dw = wanted.v_m_s - before.v_m_s, wanted.w_rad_s - before.w_rad_s
        dl = wanted.left_m_s - before.left_m_s
        needed_s = (
            max(hypot(dv, dl) / limits.acceleration_m_s2, abs(dw) / limits.turn_acceleration_rad_s2)
            / harder
        )
        share = 1.0 if needed_s <= period_s else period_s / needed_s
        self.velocity = BaseVelocity(
            before.v_m_s + share * dv, before.w_rad_s + share * dw, before.left_m_s + share * dl
        )

    def halt(self) -> None:
        """Forget the velocity: the drives no longer follow it."""
        self.velocity = STANDING


def permitted(
    wanted: BaseVelocity,
    limits: BaseLimits,
    speed_ratio: float,
    blocked: Collection[Direction],
) -> BaseVelocity:
    """Return what remains of a wanted velocity: no blocked motion, none above the speed ratio.

    All parts shrink together, so that the base slows down on its curve instead of leaving it. While
    any direction is blocked the base does not move sideways: nothing judges that.
    """
    v_m_s, w_rad_s, left_m_s = wanted
    left_m_s = 0.0 if blocked else left_m_s
    v_m_s = 0.0 if _direction(v_m_s, Direction.FORWARD, Direction.BACKWARD) in blocked else v_m_s
    w_rad_s = (
        0.0
        if _direction(w_rad_s, Direction.TURN_LEFT, Direction.TURN_RIGHT) in blocked
        else w_rad_s
    )
    share = max(hypot(v_m_s, left_m_s) / limits.speed_m_s, abs(w_rad_s) / limits.turn_rad_s)
    scale = 1.0 if share <= speed_ratio else speed_ratio / share
    return BaseVelocity(v_m_s, w_rad_s, left_m_s).times(scale)


def _direction(speed: float, positive: Direction, negative: Direction) -> Direction | None:
    if speed == 0.0:
        return None
    return positive if speed > 0.0 else negative


def _clamp(value: float, limit: float) -> float:
    return min(max(value, -limit), limit)
