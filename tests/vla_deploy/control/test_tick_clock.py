"""When a tick is late, and what time it stands for."""

import pytest

from vla_deploy.control.reporting.telemetry import TickClock

PERIOD_S = 0.004


def begun(*gaps_s: float) -> tuple[TickClock, float]:
    clock, now_ns = TickClock(PERIOD_S), 0
    lasted_s = clock.begin(now_ns)
    for gap_s in gaps_s:
        now_ns += round(gap_s * 1e9)
        lasted_s = clock.begin(now_ns)
    return clock, lasted_s


@pytest.mark.parametrize(
    ("periods", "late"), [(0.5, 0), (1.0, 0), (1.19, 0), (1.2, 0), (1.21, 1), (1.5, 1), (9.0, 1)]
)
def test_a_tick_is_late_when_more_than_a_fifth_of_its_period_is_lost(
    periods: float, late: int
) -> None:
    clock, _ = begun(periods * PERIOD_S)
    assert (clock.tick, clock.late_ticks) == (2, late)


def test_ticks_after_a_late_one_are_in_time_again() -> None:
    clock, _ = begun(PERIOD_S, 3 * PERIOD_S, PERIOD_S, PERIOD_S)
    assert clock.late_ticks == 1


def test_late_is_judged_by_the_period_that_was_in_force() -> None:
    clock = TickClock(PERIOD_S)
    clock.begin(0)
    clock.retune(2 * PERIOD_S)
    clock.begin(round(1.1 * PERIOD_S * 1e9))
    clock.begin(round(3.2 * PERIOD_S * 1e9))
    assert clock.late_ticks == 0


def test_a_tick_stands_for_at_most_two_periods() -> None:
    assert begun(1.1 * PERIOD_S)[1] == pytest.approx(1.1 * PERIOD_S)
    assert begun(50 * PERIOD_S)[1] == pytest.approx(2 * PERIOD_S)


def test_periods_are_counted_by_their_share_of_the_one_in_force() -> None:
    clock, _ = begun(0.4 * PERIOD_S, PERIOD_S, PERIOD_S, 1.3 * PERIOD_S, 20 * PERIOD_S)
    told = clock.periods.document()
    by_bound = dict(zip([*told["le"], None], told["counts"], strict=True))
    assert {bound: count for bound, count in by_bound.items() if count} == {
        0.5: 1,
        1.05: 2,
        1.5: 1,
        None: 1,
    }
    assert told["sum"] == pytest.approx(23.7)
