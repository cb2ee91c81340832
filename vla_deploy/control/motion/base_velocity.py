"""Hold a velocity of the base."""

from math import hypot
from typing import Final, NamedTuple


class BaseVelocity(NamedTuple):
    """Move ahead, turn counter-clockwise and, where the wheels can, move to the left."""

    v_m_s: float = 0.0
    w_rad_s: float = 0.0
    left_m_s: float = 0.0

    @property
    def speed_m_s(self) -> float:
        """Return how fast the middle of the base moves."""
        return hypot(self.v_m_s, self.left_m_s)

    def times(self, share: float) -> "BaseVelocity":
        """Return a velocity on the same curve, faster or slower."""
        return BaseVelocity(share * self.v_m_s, share * self.w_rad_s, share * self.left_m_s)


STANDING: Final = BaseVelocity()
