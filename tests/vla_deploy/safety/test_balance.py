"""The margin against tipping over, from centre of mass and measured acceleration."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vla_deploy.safety.balance import edge_distance, tip_margin_ratio, zero_moment_point

SUPPORT = np.array([[0.2, -0.2], [0.2, 0.2], [-0.2, 0.2], [-0.2, -0.2]])
CENTRE = np.array([0.0, 0.0, 0.4])
LEVEL = np.array([0.0, 0.0, 9.81])


def test_at_rest_the_weight_presses_below_the_centre_of_mass() -> None:
    point = zero_moment_point(np.array([0.05, -0.02, 0.4]), LEVEL)
    assert point is not None
    assert point.tolist() == [0.05, -0.02]


def test_braking_moves_the_point_forward() -> None:
    point = zero_moment_point(CENTRE, np.array([-0.981, 0.0, 9.81]))
    assert point is not None
    assert point == pytest.approx([0.04, 0.0])


def test_what_falls_presses_nowhere() -> None:
    assert zero_moment_point(CENTRE, np.array([0.0, 0.0, 0.99])) is None
    assert tip_margin_ratio(CENTRE, np.zeros(3), SUPPORT, 0.3) == 0.0


def test_distance_to_the_edge_is_negative_outside() -> None:
    assert edge_distance(np.array([0.1, 0.0]), SUPPORT) == pytest.approx(0.1)
    assert edge_distance(np.array([0.0, -0.25]), SUPPORT) == pytest.approx(-0.05)


def test_a_level_robot_has_the_whole_margin_and_arms_stretched_out_take_some() -> None:
    assert tip_margin_ratio(CENTRE, LEVEL, SUPPORT, 0.3) == 1.0
    stretched = tip_margin_ratio(np.array([0.05, 0.0, 0.4]), LEVEL, SUPPORT, 0.3)
    assert stretched == pytest.approx(0.75)


def test_a_lean_beyond_what_is_allowed_leaves_nothing() -> None:
    lean = 0.3
    leaning = 9.81 * np.array([math.sin(lean), 0.0, math.cos(lean)])
    low = np.array([0.0, 0.0, 0.01])
    assert tip_margin_ratio(low, leaning, SUPPORT, 0.3) == pytest.approx(0.0, abs=1e-9)
    assert tip_margin_ratio(low, leaning, SUPPORT, 0.6) == pytest.approx(0.5)
    assert tip_margin_ratio(np.array([0.0, 0.0, 1.0]), leaning, SUPPORT, 1.5) == 0.0


@given(st.floats(0.0, 9.0), st.floats(0.0, 2 * math.pi), st.floats(0.0, 1.0))
def test_a_harder_push_never_leaves_more_margin(push: float, bearing: float, share: float) -> None:
    aside = push * np.array([math.cos(bearing), math.sin(bearing), 0.0])
    hard = tip_margin_ratio(CENTRE, LEVEL + aside, SUPPORT, 0.5)
    soft = tip_margin_ratio(CENTRE, LEVEL + share * aside, SUPPORT, 0.5)
    assert 0.0 <= hard <= soft + 1e-9 <= 1.0 + 1e-9
