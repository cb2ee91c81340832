"""Decide whether a thing that appears is one that has left its place.

It may be one of the same class, colour and about the same size that nobody would have had to run
with to bring it there. It is then the same thing and keeps its id.
"""

from collections.abc import Iterable

import numpy as np

from drivers.clock import NS_PER_S
from vla_deploy.perception.objects.track import Track, gap_m

SIZE_RATIO = 1.6
# A person in a hurry, and what two sights of one place may differ by.
CARRY_SPEED_M_S = 2.5
SLACK_M = 0.5
# One miss may be the detector's; two in a row make a thing that is not where it was.
MISSING_MISSES = 2
# A thing that a hundred hands have moved is not known by a hundred ids: who still holds one of the
# oldest asks again. The scene's room counts on it, too.
ALIASES_KEPT = 3


def may_be(elder: Track, newer: Track) -> bool:
    """Return whether `newer` may be the thing that was known as `elder`, brought elsewhere."""
    if (elder.class_name, elder.colour) != (newer.class_name, newer.colour):
        return False
    sizes = [float(np.prod(np.maximum(one.size_m, 1e-3))) ** (1.0 / 3.0) for one in (elder, newer)]
    if max(sizes) > SIZE_RATIO * min(sizes):
        return False
    between_s = max(0.0, (newer.last_seen_ns - elder.last_seen_ns) / NS_PER_S)
    return gap_m(elder, newer) <= SLACK_M + CARRY_SPEED_M_S * between_s


def likeliest(elders: Iterable[Track], newer: Track) -> Track | None:
    """Return the nearest thing that `newer` may be, or None."""
    able = [elder for elder in elders if may_be(elder, newer)]
    return min(able, key=lambda elder: gap_m(elder, newer), default=None)


def is_missing(track: Track) -> bool:
    """Return whether a known thing is not where it was, as far as a few looks can tell."""
    return bool(track.object_id) and track.misses >= MISSING_MISSES


def take_over(newer: Track, elder: Track) -> None:
    """Let a thing have the id, and the past, of the one that it has turned out to be."""
    names = (newer.object_id, *newer.aliases, *elder.aliases)
    other = dict.fromkeys(name for name in names if name and name != elder.object_id)
    newer.aliases = tuple(other)[:ALIASES_KEPT]
    newer.object_id = elder.object_id
    newer.first_seen_ns = min(newer.first_seen_ns, elder.first_seen_ns)
