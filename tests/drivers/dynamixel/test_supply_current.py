"""A motor's current is found from what its bridge draws, by the equations of the bridge."""

import numpy as np
import pytest

from drivers.dynamixel.supply_current import motor_current_ratio


@pytest.mark.parametrize(
    ("current", "speed"),
    [
        (0.0, 0.0),
        (0.25, 0.0),
        (-0.5, 0.0),
        (0.2, 0.3),  # it drives
        (-0.2, -0.3),
        (0.1, -0.6),  # it brakes gently
        (-0.05, 0.4),
    ],
)
def test_drawn_current_and_speed_give_the_motors_current(current: float, speed: float) -> None:
    drawn = current * abs(current + speed)
    found = motor_current_ratio(np.array([drawn]), np.array([speed]))
    assert found == pytest.approx([current], abs=1e-9)
