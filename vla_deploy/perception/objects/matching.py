"""Match detections to tracks: by place and its uncertainty, by class and colour."""

import math

import numpy as np
from numpy.typing import NDArray

from vla_deploy.perception.naming.classes import OTHER
from vla_deploy.perception.objects.filtering import mahalanobis2, predicted
from vla_deploy.perception.objects.track import Sighting, Track

# Squared Mahalanobis distance of three dimensions that one true pair in a thousand exceeds. Another
# class or colour adds to it, so that such a pair must be nearer.
GATE = 16.27
CLASS_FLOOR, COLOUR_FLOOR = 0.02, 0.05
UNRECOGNISED_COST = 2.0
# A thing of the same class and colour within this distance has been pushed.
PUSHED_GATE_M = 0.12

Costs = NDArray[np.float64]


def match(
    tracks: list[Track], sightings: list[Sighting], stamp_ns: int
) -> list[tuple[Track, Sighting, bool]]:
    """Return the pairs of track and sighting, each with whether the thing was moved.

    Things that stand still are matched first, pushed ones among what is left.
    """
    if not tracks or not sightings:
        return []
    pairs = [
        (tracks[row], sightings[column], False)
        for row, column in assign(_still_costs(tracks, sightings, stamp_ns), GATE)
    ]
    taken = {id(one) for pair in pairs for one in pair[:2]}
    left = [track for track in tracks if id(track) not in taken and not track.held_by]
    rest = [one for one in sightings if id(one) not in taken and not one.is_doubtful]
    pushed = assign(_pushed_costs(left, rest), PUSHED_GATE_M)
    return pairs + [(left[row], rest[column], True) for row, column in pushed]


def _still_costs(tracks: list[Track], sightings: list[Sighting], stamp_ns: int) -> Costs:
    now = [predicted(track.estimate, stamp_ns) for track in tracks]
    costs = mahalanobis2(now, [one.seen for one in sightings])
    for row, track in enumerate(tracks):
        for column, sighting in enumerate(sightings):
            if costs[row, column] >= GATE:
                continue
            if track.cause and (sighting.is_doubtful or not track.is_like(sighting.detection)):
                # A lost thing may be anywhere near, and so may others: half-hidden or unlike ones
                # are not taken for it.
                costs[row, column] = GATE
            elif not sighting.is_doubtful:
                costs[row, column] += _unlikeness(track, sighting)
    return costs


def _unlikeness(track: Track, sighting: Sighting) -> float:
    """Return how little class and colour fit, as twice the negative logarithm of a likelihood."""
    seen = sighting.detection
    colour = COLOUR_FLOOR + (1.0 - COLOUR_FLOOR) * track.colours.share(seen.colour)
    cost = -2.0 * math.log(colour)
    if seen.class_name == track.class_name:
        return cost
    if OTHER in (seen.class_name, track.class_name):
        return cost + UNRECOGNISED_COST
    kind = CLASS_FLOOR + (1.0 - CLASS_FLOOR) * track.classes.share(seen.class_name)
    return cost - 2.0 * math.log(kind)


def _pushed_costs(tracks: list[Track], sightings: list[Sighting]) -> Costs:
    costs = np.full((len(tracks), len(sightings)), PUSHED_GATE_M)
    for row, track in enumerate(tracks):
        for column, sighting in enumerate(sightings):
            if track.is_like(sighting.detection):
                costs[row, column] = math.dist(track.position_m, sighting.detection.position_m)
    return costs


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
