import itertools

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from vla_deploy.perception.objects.matching import assign

LIMIT = 10.0
shapes = st.tuples(st.integers(0, 4), st.integers(0, 4))
costs = shapes.flatmap(lambda shape: arrays(np.float64, shape, elements=st.floats(0.0, 20.0)))


def total(cost: np.ndarray, pairs: list[tuple[int, int]]) -> float:
    """Count what stays alone as the limit that a pair of it would cost."""
    alone = min(cost.shape) - len(pairs)
    return float(sum(cost[pair] for pair in pairs)) + alone * LIMIT


def least(cost: np.ndarray) -> float:
    """Try everything."""
    wide = np.minimum(cost if cost.shape[0] <= cost.shape[1] else cost.T, LIMIT)
    orders = itertools.permutations(range(wide.shape[1]), wide.shape[0])
    return min(float(sum(wide[pair] for pair in enumerate(order))) for order in orders)


@given(costs)
def test_no_other_pairing_costs_less(cost: np.ndarray) -> None:
    pairs = assign(cost, LIMIT)
    assert len({row for row, _ in pairs}) == len({column for _, column in pairs}) == len(pairs)
    assert all(cost[pair] < LIMIT for pair in pairs)
    if cost.size:
        assert np.isclose(total(cost, pairs), least(cost))


def test_the_closest_pair_yields_where_both_then_fare_better() -> None:
    cost = np.array([[1.0, 2.0], [1.5, 9.0]])
    assert assign(cost, LIMIT) == [(0, 1), (1, 0)]


def test_what_is_forbidden_stays_alone() -> None:
    assert assign(np.array([[np.inf, 3.0], [np.inf, 4.0]]), LIMIT) == [(0, 1)]
