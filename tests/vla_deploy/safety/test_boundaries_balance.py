"""Hold numbers of the balance and of the reactions' order that no other test pins down."""

import numpy as np
import pytest

from vla_deploy.safety import Reaction
from vla_deploy.safety.balance import edge_distance, zero_moment_point

TRIANGLE = np.array([[1.0, 1.0], [4.0, 1.0], [1.0, 5.0]])  # its inscribed circle has radius 1


def test_reactions_are_numbered_without_gaps_from_none() -> None:
    assert [int(reaction) for reaction in Reaction] == list(range(len(Reaction)))
    assert min(Reaction) is Reaction.NONE


@pytest.mark.parametrize(("load_m_s2", "is_known"), [(0.999, False), (1.0, True), (1.5, True)])
def test_the_zero_moment_point_is_known_from_the_least_load_on(
    load_m_s2: float, is_known: bool
) -> None:
    point = zero_moment_point(np.array([0.1, 0.0, 0.5]), np.array([0.0, 0.0, load_m_s2]))
    assert (point is not None) is is_known


@pytest.mark.parametrize(
    ("point", "distance_m"), [((2.0, 2.0), 1.0), ((1.5, 2.5), 0.5), ((0.0, 2.0), -1.0)]
)
def test_edges_are_where_they_are_also_far_from_the_origin(
    point: tuple[float, float], distance_m: float
) -> None:
    assert edge_distance(np.array(point), TRIANGLE) == pytest.approx(distance_m)
