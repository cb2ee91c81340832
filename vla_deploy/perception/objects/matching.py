"""Decide which sight is which known thing: by place and its uncertainty, by class and colour."""

import math

import numpy as np
from numpy.typing import NDArray

from vla_deploy.perception.naming.classes import OTHER
from vla_deploy.perception.objects.assignment import assign
from vla_deploy.perception.objects.filtering import distances2, grown
from vla_deploy.perception.objects.track import Sighting, Track

# Squared Mahalanobis distance of three dimensions that one true pair in a thousand exceeds. What
# is unlike in class or colour costs some of it, so that it must be nearer.
GATE = 16.27
CLASS_FLOOR, COLOUR_FLOOR = 0.02, 0.05
UNRECOGNISED_COST = 2.0
# Something alike within this way has been pushed.
PUSHED_GATE_M = 0.12


def match(
    tracks: list[Track], sightings: list[Sighting], stamp_ns: int
) -> list[tuple[Track, Sighting, bool]]:
    """Return each pair of track and sight, with whether the thing was moved since the last one.

    Things that stand still come first; a pushed one is looked for among what is left.
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


def _still_costs(
    tracks: list[Track], sightings: list[Sighting], stamp_ns: int
) -> NDArray[np.float64]:
    now = [grown(track.estimate, stamp_ns) for track in tracks]
    costs = distances2(now, [one.seen for one in sightings])
    for row, track in enumerate(tracks):
        for column, sighting in enumerate(sightings):
            if costs[row, column] >= GATE:
                continue
            if track.cause and not _is_found(track, sighting):
                costs[row, column] = GATE
            elif not sighting.is_doubtful:
                costs[row, column] += _unlikeness(track, sighting)
    return costs


def _is_found(track: Track, sighting: Sighting) -> bool:
    """Return whether a sight shows a thing that was lost: it may be anywhere near, as much else is.

    So nothing half seen, and nothing of another class or colour, is taken for it.
    """
    seen = sighting.detection
    alike = (seen.class_name, seen.colour) == (track.class_name, track.colour)
    return alike and not sighting.is_doubtful


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


def _pushed_costs(tracks: list[Track], sightings: list[Sighting]) -> NDArray[np.float64]:
    costs = np.full((len(tracks), len(sightings)), PUSHED_GATE_M)
    for row, track in enumerate(tracks):
        for column, sighting in enumerate(sightings):
            seen = sighting.detection
            if (seen.class_name, seen.colour) == (track.class_name, track.colour):
                costs[row, column] = math.dist(track.position_m, seen.position_m)
    return costs
