"""Judge how well the robot knows where it is: tracking, unsure or lost, and why.

The judge is pure: it takes one fact at a time and has no clock of its own.
"""

from typing import Final

from drivers.clock import NS_PER_S
from vla_deploy.client.place_state import Doubt, PlaceState

# A scan fits with MATCH_RATIO of its points on the map; a place is sure from SURE_RATIO on.
MATCH_RATIO: Final = 0.6
SURE_RATIO: Final = 0.75
THROUGH_RATIO: Final = 0.15
UNSURE_AFTER_SCANS: Final = 3
LOST_AFTER_SCANS: Final = 15
SURE_AFTER_SCANS: Final = 5
SILENT_NS: Final = NS_PER_S
UNSURE_SIGMA_M: Final = 0.15
UNSURE_SIGMA_RAD: Final = 0.15
LOST_SIGMA_M: Final = 0.6


class PlaceJudge:
    """Follow the verdicts with hysteresis."""

    def __init__(self) -> None:
        self.state = PlaceState.UNSURE
        self.doubt = Doubt.STARTING
        self.is_anchored = False
        """Whether scans have borne out a place since the start, or since the robot was lost."""
        self._good = 0
        self._bad = 0
        self._weak = 0
        self._good_ns: int | None = None

    def take(
        self, stamp_ns: int, doubt: Doubt, match_ratio: float, sigma_m: float, sigma_rad: float
    ) -> None:
        """Take in what a scan says of the pose: the doubt that it casts, and how well it fits."""
        if doubt is Doubt.NO_SCAN:
            self.pass_time(stamp_ns, sigma_m, sigma_rad)
            return
        if doubt is not Doubt.NONE:
            self._good, self._bad = 0, self._bad + 1
            self._take_bad(doubt)
            return
        fits_well = match_ratio >= SURE_RATIO
        self._good, self._bad, self._good_ns = self._good + 1 if fits_well else 0, 0, stamp_ns
        certain = sigma_m < UNSURE_SIGMA_M and sigma_rad < UNSURE_SIGMA_RAD
        self._weak = 0 if fits_well else self._weak + 1
        if self.state is not PlaceState.UNSURE:
            return
        if self._good >= SURE_AFTER_SCANS and certain:
            self.state, self.doubt, self.is_anchored = PlaceState.TRACKING, Doubt.NONE, True
        elif self._weak >= LOST_AFTER_SCANS:
            self.doubt, self.is_anchored = Doubt.POOR_MATCH, True  # it fits no other place better

    def pass_time(self, now_ns: int, sigma_m: float, sigma_rad: float) -> None:
        """Take in that time has passed, in which the pose may have become unsure."""
        if self._good_ns is None:
            self._good_ns = now_ns
        if self.state is PlaceState.TRACKING and now_ns - self._good_ns > SILENT_NS:
            self._fall(PlaceState.UNSURE, Doubt.NO_SCAN)
        if sigma_m > LOST_SIGMA_M and self.state is not PlaceState.LOST:
            self._fall(PlaceState.LOST, Doubt.UNCERTAIN)
        elif self.state is PlaceState.TRACKING and (
            sigma_m > UNSURE_SIGMA_M or sigma_rad > UNSURE_SIGMA_RAD
        ):
            self._fall(PlaceState.UNSURE, Doubt.UNCERTAIN)

    def found(self, stamp_ns: int) -> None:
        """Take a place that was searched for and found; scans must confirm it."""
        self._fall(PlaceState.UNSURE, Doubt.FOUND_AGAIN)
        self._good_ns = stamp_ns

    def search_found(self, places: int) -> None:
        """Take the number of places that fit, while lost."""
        if self.state is PlaceState.LOST and places > 1:
            self.doubt = Doubt.AMBIGUOUS

    def _take_bad(self, doubt: Doubt) -> None:
        if self.state is PlaceState.LOST:
            return
        if self._bad >= LOST_AFTER_SCANS:
            self._fall(PlaceState.LOST, doubt)
        elif self._bad >= UNSURE_AFTER_SCANS:
            keeps = self.state is PlaceState.UNSURE and self.doubt is Doubt.FOUND_AGAIN
            bad = self._bad
            self._fall(PlaceState.LOST if keeps else PlaceState.UNSURE, doubt)
            self._bad = bad

    def _fall(self, state: PlaceState, doubt: Doubt) -> None:
        self.state, self.doubt = state, doubt
        self.is_anchored &= state is not PlaceState.LOST
        self._good = self._bad = self._weak = 0
