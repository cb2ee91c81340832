import pytest

from vla_deploy.client.place_state import DOUBT_TEXT, Doubt, PlaceState
from vla_deploy.navigation.localising.place_judge import (
    LOST_AFTER_SCANS,
    LOST_SIGMA_M,
    SILENT_NS,
    SURE_AFTER_SCANS,
    UNSURE_AFTER_SCANS,
    UNSURE_SIGMA_M,
    PlaceJudge,
)

SCAN_NS = 100_000_000


class Course:
    """Feed a judge scans, ten a second."""

    def __init__(self) -> None:
        self.judge = PlaceJudge()
        self.now_ns = 0

    def scans(
        self, count: int, doubt: Doubt = Doubt.NONE, ratio: float = 0.95, sigma_m: float = 0.01
    ) -> PlaceState:
        for _ in range(count):
            self.now_ns += SCAN_NS
            self.judge.take(self.now_ns, doubt, ratio, sigma_m, sigma_rad=0.01)
        return self.judge.state


@pytest.fixture
def course() -> Course:
    made = Course()
    made.scans(SURE_AFTER_SCANS)
    return made


def test_it_begins_unsure_and_good_scans_make_it_sure() -> None:
    fresh = Course()
    assert (fresh.judge.state, fresh.judge.doubt) == (PlaceState.UNSURE, Doubt.STARTING)
    assert fresh.scans(SURE_AFTER_SCANS - 1) is PlaceState.UNSURE
    assert fresh.scans(1) is PlaceState.TRACKING
    assert fresh.judge.doubt is Doubt.NONE


@pytest.mark.parametrize(
    "doubt", [Doubt.POOR_MATCH, Doubt.THROUGH_WALLS, Doubt.INCONSISTENT], ids=lambda d: d.name
)
def test_bad_scans_make_it_unsure_then_lost_with_their_reason(course: Course, doubt: Doubt) -> None:
    assert course.scans(UNSURE_AFTER_SCANS - 1, doubt) is PlaceState.TRACKING
    assert course.scans(1, doubt) is PlaceState.UNSURE
    assert course.scans(LOST_AFTER_SCANS - UNSURE_AFTER_SCANS - 1, doubt) is PlaceState.UNSURE
    assert course.scans(1, doubt) is PlaceState.LOST
    assert course.judge.doubt is doubt


def test_one_good_scan_among_bad_ones_is_not_enough_to_be_sure_again(course: Course) -> None:
    course.scans(UNSURE_AFTER_SCANS, Doubt.POOR_MATCH)
    assert course.scans(1) is PlaceState.UNSURE
    assert course.scans(SURE_AFTER_SCANS) is PlaceState.TRACKING


def test_scans_that_fit_just_so_keep_a_place_but_never_make_it_sure(course: Course) -> None:
    assert course.scans(50, ratio=0.65) is PlaceState.TRACKING
    fresh = Course()
    assert fresh.scans(50, ratio=0.65) is PlaceState.UNSURE
    assert fresh.judge.doubt is Doubt.POOR_MATCH


def test_a_lost_robot_stays_lost_until_its_place_is_found_and_confirmed(course: Course) -> None:
    course.scans(LOST_AFTER_SCANS, Doubt.POOR_MATCH)
    assert course.scans(20) is PlaceState.LOST
    course.judge.search_found(3)
    assert course.judge.doubt is Doubt.AMBIGUOUS
    course.judge.found(course.now_ns)
    assert (course.judge.state, course.judge.doubt) == (PlaceState.UNSURE, Doubt.FOUND_AGAIN)
    assert course.scans(SURE_AFTER_SCANS) is PlaceState.TRACKING


def test_a_place_found_wrongly_is_given_up_at_once(course: Course) -> None:
    course.scans(LOST_AFTER_SCANS, Doubt.POOR_MATCH)
    course.judge.found(course.now_ns)
    assert course.scans(UNSURE_AFTER_SCANS, Doubt.THROUGH_WALLS) is PlaceState.LOST


def test_silence_makes_it_unsure_and_a_large_covariance_lost(course: Course) -> None:
    course.judge.pass_time(course.now_ns + SILENT_NS, 0.01, 0.01)
    assert course.judge.state is PlaceState.TRACKING
    course.judge.pass_time(course.now_ns + SILENT_NS + 1, 0.01, 0.01)
    assert (course.judge.state, course.judge.doubt) == (PlaceState.UNSURE, Doubt.NO_SCAN)
    course.judge.pass_time(course.now_ns + SILENT_NS + 2, LOST_SIGMA_M + 0.01, 0.01)
    assert (course.judge.state, course.judge.doubt) == (PlaceState.LOST, Doubt.UNCERTAIN)


def test_a_wide_covariance_alone_makes_it_unsure(course: Course) -> None:
    course.judge.pass_time(course.now_ns, UNSURE_SIGMA_M + 0.01, 0.01)
    assert (course.judge.state, course.judge.doubt) == (PlaceState.UNSURE, Doubt.UNCERTAIN)


def test_every_doubt_has_words() -> None:
    assert set(DOUBT_TEXT) == set(Doubt)


def test_a_place_is_borne_out_by_scans_until_the_robot_is_lost() -> None:
    course = Course()
    assert not course.judge.is_anchored
    course.scans(SURE_AFTER_SCANS)
    assert course.judge.is_anchored
    course.scans(UNSURE_AFTER_SCANS, Doubt.POOR_MATCH)
    assert course.judge.is_anchored, "it may be people around"
    course.scans(LOST_AFTER_SCANS, Doubt.POOR_MATCH)
    assert not course.judge.is_anchored
    course.judge.found(course.now_ns)
    assert not course.judge.is_anchored
    course.scans(SURE_AFTER_SCANS)
    assert course.judge.is_anchored


def test_a_place_that_fits_badly_but_better_than_others_is_taken_in_the_end() -> None:
    course = Course()
    course.scans(LOST_AFTER_SCANS, ratio=0.6)
    assert (course.judge.state, course.judge.doubt) == (PlaceState.UNSURE, Doubt.POOR_MATCH)
    assert course.judge.is_anchored
