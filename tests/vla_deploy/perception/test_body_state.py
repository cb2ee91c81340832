import numpy as np
import pytest

from vla_deploy.perception.objects.body_state import KEEP_NS, JointHistory

TOLERANCE_NS = 50


def filled() -> JointHistory:
    history = JointHistory()
    for stamp in (100, 120, 140, 400):
        history.add(stamp, np.array([stamp, -stamp], dtype=np.float64))
    return history


@pytest.mark.parametrize(("stamp", "expected"), [(100, 100), (110, 110), (133, 133), (90, 100)])
def test_positions_are_interpolated(stamp: int, expected: float) -> None:
    got = filled().at(stamp, TOLERANCE_NS)
    assert got == pytest.approx([expected, -expected])


@pytest.mark.parametrize("stamp", [20, 150, 250, 460])
def test_a_moment_too_far_from_any_sample_is_unknown(stamp: int) -> None:
    assert filled().at(stamp, TOLERANCE_NS) is None


def test_a_sample_after_a_gap_is_not_blended_with_the_one_before() -> None:
    assert filled().at(399, TOLERANCE_NS) is None
    assert filled().at(400, TOLERANCE_NS) == pytest.approx([400, -400])


def test_an_empty_history_knows_nothing() -> None:
    assert JointHistory().at(0, TOLERANCE_NS) is None


def test_old_samples_go_and_stale_ones_are_not_taken() -> None:
    history = filled()
    history.add(400, np.zeros(2))
    assert history.at(400, 0) == pytest.approx([400, -400])
    history.add(KEEP_NS + 130, np.zeros(2))
    assert history.at(120, 5) is None
