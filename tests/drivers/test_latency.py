import random

import pytest

from drivers.latency import LatencyHistogram


def histogram_of(values: list[int]) -> LatencyHistogram:
    histogram = LatencyHistogram()
    for value in values:
        histogram.record(value)
    return histogram


def test_nothing_recorded_is_zero_everywhere() -> None:
    reported = LatencyHistogram().as_dict()
    bounds_s, counts = reported.pop("le_s"), reported.pop("counts")
    assert set(reported.values()) == {0}
    assert counts == [0] * len(bounds_s)


@pytest.mark.parametrize("value", [0, 1, 7, 8, 15, 16, 17, 1000, 123_456, 10**9, 6 * 10**10])
def test_a_single_value_is_exact(value: int) -> None:
    histogram = histogram_of([value])
    assert histogram.percentile_ns(0.5) == histogram.max_ns == histogram.mean_ns == value


@pytest.mark.parametrize("span_ns", [20, 5_000, 3_000_000, 2 * 10**9])
def test_percentiles_are_never_low_and_at_most_an_eighth_high(span_ns: int) -> None:
    chance = random.Random(5)
    values = sorted(chance.randrange(span_ns) for _ in range(5000))
    histogram = histogram_of(values)
    for ratio in (0.01, 0.5, 0.9, 0.99, 0.999, 1.0):
        exact = values[max(0, -(-round(ratio * len(values) * 1000) // 1000) - 1)]
        assert exact <= histogram.percentile_ns(ratio) <= exact * 9 / 8 + 1


def test_what_is_beyond_the_last_bucket_or_before_the_first_is_counted() -> None:
    histogram = histogram_of([-5, 10**15])
    assert histogram.count == 2
    assert histogram.max_ns == 10**15
    assert histogram.percentile_ns(0.0) == 0


def test_counts_by_octave_are_those_below_each_bound() -> None:
    chance = random.Random(7)
    values = [chance.randrange(2 * 10**8) for _ in range(3000)]
    reported = histogram_of(values).as_dict()
    expected = [sum(value < bound_s * 10**9 for value in values) for bound_s in reported["le_s"]]
    assert reported["counts"] == expected
    assert 0 < expected[0] < expected[-1] < len(values)


def test_a_reset_starts_over() -> None:
    histogram = histogram_of([5, 10_000])
    histogram.reset()
    assert histogram.as_dict() == LatencyHistogram().as_dict()


def test_a_ratio_beyond_one_is_refused() -> None:
    with pytest.raises(ValueError, match=r"within 0..1, got 50"):
        LatencyHistogram().percentile_ns(50)
