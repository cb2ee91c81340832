"""Pair the rows and columns of a cost matrix so that the total cost is least."""

import numpy as np
from numpy.typing import NDArray

Costs = NDArray[np.float64]


def assign(cost: Costs, limit: float) -> list[tuple[int, int]]:
    """Return the (row, column) pairs of least total cost, each below `limit`.

    A pair that costs `limit` or more is worse than none: both stay alone.
    """
    if not cost.size:
        return []
    if cost.shape[0] > cost.shape[1]:
        return sorted((row, column) for column, row in assign(cost.T, limit))
    bounded = np.minimum(cost, limit)
    pairs = ((row, column) for column, row in enumerate(_row_of_columns(bounded)) if row >= 0)
    return sorted((row, column) for row, column in pairs if cost[row, column] < limit)


def _row_of_columns(cost: Costs) -> list[int]:
    """Return the row of each column, -1 for none, by shortest augmenting paths.

    The Hungarian method with potentials: index 0 of what follows is a column before the first, to
    which the row that is to be placed belongs at first.
    """
    rows, columns = cost.shape
    row_price, column_price = np.zeros(rows + 1), np.zeros(columns + 1)
    row_of = np.zeros(columns + 1, dtype=np.intp)
    for row in range(1, rows + 1):
        row_of[0] = row
        before = _search(cost, row_of, row_price, column_price)
        column = int(before[0])
        while column:
            earlier = int(before[column])
            row_of[column] = row_of[earlier]
            column = earlier
    return [int(row) - 1 for row in row_of[1:]]


def _search(
    cost: Costs, row_of: NDArray[np.intp], row_price: Costs, column_price: Costs
) -> NDArray[np.intp]:
    """Find the cheapest way to a free column; return each column's predecessor on the way.

    The predecessor of column 0, which has none, is where the way ends.
    """
    columns = cost.shape[1]
    before = np.zeros(columns + 1, dtype=np.intp)
    least = np.full(columns + 1, np.inf)
    done = np.zeros(columns + 1, dtype=np.bool_)
    column = 0
    while row_of[column]:
        done[column] = True
        row = int(row_of[column])
        reduced = cost[row - 1] - row_price[row] - column_price[1:]
        nearer = ~done[1:] & (reduced < least[1:])
        least[1:][nearer], before[1:][nearer] = reduced[nearer], column
        following = int(np.argmin(np.where(done[1:], np.inf, least[1:]))) + 1
        step = least[following]
        row_price[row_of[done]] += step
        column_price[done] -= step
        least[~done] -= step
        column = following
    before[0] = column
    return before
