import numpy as np
import pytest

from vla_deploy.perception.objects.filtering import (
    MOST_SIGMA_M,
    Estimate,
    carried,
    mahalanobis2,
    predicted,
    updated,
)

SECOND_NS = 1_000_000_000


def sight(x_m: float, sigma_m: float = 0.01, at_s: float = 0.0) -> Estimate:
    return Estimate(
        position_m=np.array([x_m, 0.0, 0.5]),
        covariance_m2=sigma_m**2 * np.eye(3),
        stamp_ns=round(at_s * SECOND_NS),
    )


def test_the_surer_of_two_sights_counts_for_more() -> None:
    both = updated(sight(1.0, 0.01), sight(1.05, 0.02))
    assert both.position_m[0] == pytest.approx(1.01)
    assert both.sigma_m[0] == pytest.approx(0.01 / np.sqrt(1.25))


def test_how_sure_one_is_matches_how_wrong_one_is() -> None:
    """The innovation is consistent: over many noisy runs, errors are as large as they are told."""
    random, told, errors = np.random.default_rng(0), [], []
    for _ in range(200):
        known = sight(random.normal(0.0, 0.01))
        for look in range(1, 10):
            known = updated(known, sight(random.normal(0.0, 0.01), at_s=0.2 * look))
        told.append(known.sigma_m[0])
        errors.append(known.position_m[0])
    assert 0.8 < np.std(errors) / np.mean(told) < 1.1


def test_what_nobody_looks_at_is_less_and_less_sure_up_to_a_bound() -> None:
    known = sight(1.0)
    sigmas = [predicted(known, round(age_s * SECOND_NS)).sigma_m[0] for age_s in (0, 60, 600, 1e6)]
    assert sigmas == sorted(sigmas)
    assert sigmas[1] == pytest.approx(np.hypot(0.01, 0.003 * np.sqrt(60)))
    assert sigmas[-1] == pytest.approx(MOST_SIGMA_M)


def test_a_guess_wider_than_the_bound_is_not_made_surer_by_time() -> None:
    assert predicted(sight(1.0, 0.4), SECOND_NS).sigma_m[0] == pytest.approx(0.4)


def test_an_older_stamp_takes_nothing_back() -> None:
    later = sight(1.0, at_s=5.0)
    assert predicted(later, SECOND_NS).stamp_ns == later.stamp_ns


def test_sights_that_err_alike_count_as_one() -> None:
    once = updated(sight(1.0), sight(1.02), looks=9.0)
    assert once.position_m[0] == pytest.approx(1.002)


def test_distance_is_measured_in_standard_deviations_along_the_line_of_sight() -> None:
    narrow = Estimate(position_m=np.zeros(3), covariance_m2=np.diag((1e-6, 1e-2, 1e-6)), stamp_ns=0)
    ahead, aside = (
        Estimate(position_m=np.array(at), covariance_m2=1e-6 * np.eye(3), stamp_ns=0)
        for at in ((0.05, 0.0, 0.0), (0.0, 0.05, 0.0))
    )
    far, near = mahalanobis2([narrow], [ahead, aside])[0]
    assert far > 1000.0
    assert near < 0.3


def test_a_thing_in_a_hand_is_where_the_hand_is() -> None:
    held = carried((0.3, 0.1, 0.7), SECOND_NS)
    assert held.position_m.tolist() == [0.3, 0.1, 0.7]
    assert held.sigma_m[2] == pytest.approx(0.03)
