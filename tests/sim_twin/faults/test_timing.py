import pytest

from sim_twin.faults.timing import FaultTiming


def on_times(timing: FaultTiming, until_s: float, step_s: float = 0.1) -> list[float]:
    return [
        round(n * step_s, 1) for n in range(round(until_s / step_s)) if timing.is_on(n * step_s)
    ]


def test_a_fault_begins_at_its_start_and_lasts_its_duration() -> None:
    assert on_times(FaultTiming(start_s=0.25, duration_s=0.3), 1.0) == [0.3, 0.4, 0.5]


def test_without_a_duration_it_lasts_for_ever() -> None:
    timing = FaultTiming(start_s=1.0)
    assert timing.is_on(1e6)
    assert not timing.is_over(1e6)


def test_it_is_over_when_its_duration_has_passed() -> None:
    timing = FaultTiming(start_s=1.0, duration_s=2.0)
    assert not timing.is_over(2.9)
    assert timing.is_over(3.0)


def test_a_duty_ratio_switches_it_within_each_period() -> None:
    assert on_times(FaultTiming(period_s=1.0, duty_ratio=0.25), 2.0) == [
        *(0.0, 0.1, 0.2),
        *(1.0, 1.1, 1.2),
    ]


def test_a_probability_switches_whole_periods_the_same_way_for_the_same_seed() -> None:
    def periods(seed: int) -> list[bool]:
        timing = FaultTiming(period_s=1.0, probability=0.3, seed=seed)
        assert all(timing.is_on(n + 0.1) == timing.is_on(n + 0.9) for n in range(50))
        return [timing.is_on(n + 0.5) for n in range(1000)]

    assert periods(1) == periods(1)
    assert periods(1) != periods(2)
    assert sum(periods(1)) == pytest.approx(300, abs=50)
