"""Find a motor's current where a servo measures only what it draws from the supply, as an X330.

A bridge draws the motor's current times its duty, and the duty is current plus speed, as ratios of
stall current and no-load speed. So i (i + w) is what is drawn where the motor drives, and
i (-i - w) where it brakes; of the roots of the latter the smaller one is taken: hard braking draws
no more than gentle braking does, and cannot be told from it.
"""

from typing import Final

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

_HALF: Final = 0.5


def motor_current_ratio(drawn_ratio: Floats, speed_ratio: Floats) -> Floats:
    """Return the motors' currents by what is drawn, with its sign, and their speeds, (n,) each."""
    drawn, along = np.abs(drawn_ratio), np.sign(drawn_ratio) * speed_ratio
    driving = np.sqrt(along**2 + 4.0 * drawn) - along
    left = along**2 - 4.0 * drawn
    brakes = (along < 0.0) & (left >= 0.0)
    braking = -along - np.sqrt(np.maximum(left, 0.0))
    ratio: Floats = np.sign(drawn_ratio) * _HALF * np.where(brakes, braking, driving)
    return ratio
