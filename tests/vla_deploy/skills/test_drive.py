"""The base goes no faster than a plan asks, and no faster than its robot file lets it."""

from types import SimpleNamespace

import pytest

from vla_deploy.robots import load_robot
from vla_deploy.skills.movements.drive import CRUISE_RATIO, limits_of


@pytest.mark.parametrize(("asked_m_s", "ratio"), [(None, CRUISE_RATIO), (0.2, 0.4), (9.0, 0.9)])
def test_the_cruise_is_what_was_asked_up_to_what_the_robot_may(
    asked_m_s: float | None, ratio: float
) -> None:
    context = SimpleNamespace(robot=load_robot("butler"))
    most_m_s = context.robot.base.max_speed_m_s
    assert limits_of(context, asked_m_s).speed_m_s == pytest.approx(ratio * most_m_s)
