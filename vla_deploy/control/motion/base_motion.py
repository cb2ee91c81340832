"""Bring the base from its present velocity to the wanted one, no faster than it can bear."""

from collections.abc import Collection
from dataclasses import dataclass

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
        self.v_m_s = 0.0
        self.w_rad_s = 0.0
        self._limits = limits

    @property
    def at_rest(self) -> bool:
        """Return whether the commanded velocity is zero."""
        return self.v_m_s == 0.0 and self.w_rad_s == 0.0

    def advance(self, v_m_s: float, w_rad_s: float, period_s: float) -> None:
        """Move towards a wanted velocity for one period; both parts reach it together."""
        limits = self._limits
        self._move(
            _clamp(v_m_s, limits.speed_m_s), _clamp(w_rad_s, limits.turn_rad_s), 1.0, period_s
        )

    def brake(self, period_s: float) -> None:
        """Move towards rest for one period, as fast as the robot can bear where it must stop."""
        limits = self._limits
        harder = max(1.0, limits.stop_deceleration_m_s2 / limits.acceleration_m_s2)
        self._move(0.0, 0.0, harder, period_s)

    def _move(self, v_m_s: float, w_rad_s: float, harder: float, period_s: float) -> None:
        limits = self._limits
        dv, dw = v_m_s - self.v_m_s, w_rad_s - self.w_rad_s
        needed_s = (
            max(abs(dv) / limits.acceleration_m_s2, abs(dw) / limits.turn_acceleration_rad_s2)
            / harder
        )
        share = 1.0 if needed_s <= period_s else period_s / needed_s
        self.v_m_s += share * dv
        self.w_rad_s += share * dw

    def halt(self) -> None:
        """Forget the velocity: the drives no longer follow it."""
        self.v_m_s = self.w_rad_s = 0.0


def permitted(
    wanted: tuple[float, float],
    limits: BaseLimits,
    speed_ratio: float,
    blocked: Collection[Direction],
) -> tuple[float, float]:
    """Return what remains of a wanted velocity: no blocked motion, none above the speed ratio.

    Both parts shrink together, so that the base slows down on its curve instead of leaving it.
    """
    v_m_s, w_rad_s = wanted
    v_m_s = 0.0 if _direction(v_m_s, Direction.FORWARD, Direction.BACKWARD) in blocked else v_m_s
    w_rad_s = (
        0.0
        if _direction(w_rad_s, Direction.TURN_LEFT, Direction.TURN_RIGHT) in blocked
        else w_rad_s
    )
    share = max(abs(v_m_s) / limits.speed_m_s, abs(w_rad_s) / limits.turn_rad_s)
    scale = 1.0 if share <= speed_ratio else speed_ratio / share
    return scale * v_m_s, scale * w_rad_s


def _direction(speed: float, positive: Direction, negative: Direction) -> Direction | None:
    if speed == 0.0:
        return None
    return positive if speed > 0.0 else negative


def _clamp(value: float, limit: float) -> float:
    return min(max(value, -limit), limit)
