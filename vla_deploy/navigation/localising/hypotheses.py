"""Find the robot on the map again: search, then let scans decide among the places found.

One scan may fit several places. They are carried along by dead reckoning and judged by every
further scan, until one alone is left or none fits any more; then the search begins anew.
"""

from dataclasses import dataclass
from typing import Final

from vla_deploy.navigation.localising.global_search import GlobalSearch, WallImage, local_points
from vla_deploy.navigation.localising.scan_match import Match, ScanPoints, fit
from vla_deploy.navigation.maps.distance_field import DistanceField
from vla_deploy.robots.floor_pose import ORIGIN, Pose2D

HEADINGS_PER_STEP: Final = 4
# A place is believed only where the scan fits as well as this, and clearly better than elsewhere.
FOUND_SCORE: Final = 0.75
LEFT_SCORE: Final = 0.5
MARGIN: Final = 0.15
CONFIRMING_SCANS: Final = 3
MOST_PLACES: Final = 6
DOUBLE_M: Final = 0.1
DOUBLE_RAD: Final = 0.1


@dataclass(slots=True)
class _Place:
    """Hold where the dead-reckoned frame would lie on the map, and how scans fit there."""

    map_from_track: Pose2D
    score: float
    match: Match


class Relocaliser:
    """Look for the robot while it is lost."""

    def __init__(self, field: DistanceField) -> None:
        self._field = field
        self._image: WallImage | None = None
        self._search: GlobalSearch | None = None
        self._search_base = ORIGIN
        self._places: list[_Place] = []
        self._scans = 0

    @property
    def places(self) -> int:
        """Return how many places still fit; 0 while the search goes on."""
        return len(self._places)

    def reset(self) -> None:
        """Forget everything but the map."""
        self._search, self._places, self._scans = None, [], 0

    def work(self) -> None:
        """Go on with a search, a few milliseconds' worth."""
        if self._search is None:
            return
        if not self._search.finished:
            self._search.advance(HEADINGS_PER_STEP)
            return
        fitting = [one for one in self._search.matches if one.score >= LEFT_SCORE]
        track_origin = ORIGIN.relative_to(self._search_base)
        self._places = [
            _Place(one.pose.compose(track_origin), one.score, one) for one in fitting[:MOST_PLACES]
        ]
        self._search, self._scans = None, 0

    def take(self, scan: ScanPoints, base: Pose2D) -> Match | None:
        """Take a scan and the base's pose, both in the track; return the place once it is sure."""
        if self._search is not None:
            return None
        if not self._places:
            self._begin(scan, base)
            return None
        for place in self._places:
            self._judge(place, scan, base)
        self._drop()
        self._scans += 1
        best = self._places[0] if self._places else None
        if best is None or self._scans < CONFIRMING_SCANS or len(self._places) > 1:
            return None
        if best.score < FOUND_SCORE:
            self.reset()
            return None
        return best.match

    def _begin(self, scan: ScanPoints, base: Pose2D) -> None:
        if self._image is None:
            self._image = WallImage(self._field)
        local = local_points(scan, base)
        self._search, self._search_base = GlobalSearch(self._field, self._image, local), base

    def _judge(self, place: _Place, scan: ScanPoints, base: Pose2D) -> None:
        frame = place.map_from_track
        match = fit(self._field, scan.placed(frame), frame.compose(base))
        place.match = match
        place.score = 0.7 * place.score + 0.3 * match.score
        place.map_from_track = match.pose.compose(ORIGIN.relative_to(base))

    def _drop(self) -> None:
        """Drop the places that fit badly, or clearly worse than the best; and doubles."""
        self._places.sort(key=lambda one: -one.score)
        least = max(LEFT_SCORE, self._places[0].score - MARGIN)
        kept: list[_Place] = []
        for place in self._places:
            if place.score >= least and not any(_is_double(place, one) for one in kept):
                kept.append(place)
        self._places = kept


def _is_double(one: _Place, other: _Place) -> bool:
    pose, near = one.match.pose, other.match.pose
    return pose.distance_m(near) < DOUBLE_M and pose.turn_rad(near) < DOUBLE_RAD
