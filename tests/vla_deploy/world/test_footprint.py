import math
from collections.abc import Callable

import pytest

from vla_deploy.world import Thing
from vla_deploy.world.footprint import depth_inside_m, gap_m, is_round, polygon_depth_m

Make = Callable[..., Thing]
SQUARE = ((0.0, 0.0), (2.0, 0.0), (2.0, 1.0), (0.0, 1.0))


def test_how_far_inside_or_outside_a_turned_rectangle(thing: Make) -> None:
    book = thing("book", 1.0, 0.0, yaw_rad=math.pi / 2)
    assert depth_inside_m((1.0, 0.08), book) == pytest.approx(0.02)
    assert depth_inside_m((1.0, 0.13), book) == pytest.approx(-0.03)
    assert depth_inside_m((1.065 + 0.03, 0.1 + 0.04), book) == pytest.approx(-0.05)


def test_a_cup_is_round_and_a_box_never(thing: Make) -> None:
    assert is_round(thing("cup", 0, 0))
    assert not is_round(thing("box", 0, 0))
    assert depth_inside_m((0.05, 0.0), thing("cup", 0, 0)) == pytest.approx(-0.017)


def test_gaps_do_not_depend_on_the_order(thing: Make) -> None:
    cup, ball = thing("cup", 1.0, 0.0), thing("ball", 1.2, 0.0)
    book, box = thing("book", 1.3, 0.0), thing("box", 1.6, 0.0)
    for one, other, expected in (
        (cup, ball, 0.2 - 0.033 - 0.025),
        (ball, box, 0.4 - 0.025 - 0.12),
        (book, box, 0.3 - 0.1 - 0.12),
    ):
        assert gap_m(one, other) == pytest.approx(expected)
        assert gap_m(other, one) == pytest.approx(expected)


def test_what_overlaps_has_a_negative_gap(thing: Make) -> None:
    assert gap_m(thing("book", 1.0, 0.0), thing("box", 1.1, 0.0)) < -0.1


@pytest.mark.parametrize(
    ("point", "depth_m"),
    [((1.0, 0.4), 0.4), ((1.9, 0.5), 0.1), ((2.3, 0.5), -0.3), ((2.3, 1.4), -0.5)],
)
def test_a_point_and_a_polygon_of_either_turn(point: tuple[float, float], depth_m: float) -> None:
    for corners in (SQUARE, SQUARE[::-1]):
        assert polygon_depth_m(point, corners) == pytest.approx(depth_m)
