import pytest

from sim_twin.pacer import Pacer, RealTimeFactor

MS = 1_000_000


def steps_due(pacer: Pacer, wall_ns: int) -> int:
    steps = 0
    while pacer.due(wall_ns):
        pacer.stepped()
        steps += 1
    return steps


def test_a_step_falls_due_every_period() -> None:
    pacer = Pacer(2 * MS, start_ns=0)
    assert [steps_due(pacer, wall) for wall in (0, 1 * MS, 2 * MS, 4 * MS)] == [1, 0, 1, 1]


def test_the_wait_lasts_until_the_next_step() -> None:
    pacer = Pacer(2 * MS, start_ns=0)
    steps_due(pacer, 0)
    assert pacer.wait_ns(MS) == MS
    assert pacer.wait_ns(3 * MS) == 0


def test_between_two_steps_time_goes_on_but_never_past_the_next() -> None:
    pacer = Pacer(2 * MS, start_ns=0)
    steps_due(pacer, 0)
    assert [pacer.since_step_ns(wall) for wall in (0, MS, 2 * MS, 9 * MS)] == [
        0,
        MS,
        2 * MS,
        2 * MS,
    ]


def test_a_lag_within_the_cap_is_caught_up() -> None:
    pacer = Pacer(2 * MS, start_ns=0)
    assert steps_due(pacer, 20 * MS) == 11
    assert pacer.slipped_ns == 0


def test_a_lag_beyond_the_cap_slips_instead_of_bursting() -> None:
    pacer = Pacer(2 * MS, start_ns=0)
    assert steps_due(pacer, 1000 * MS) == 11
    assert pacer.slipped_ns == 980 * MS


def test_time_that_slipped_is_never_made_up_later() -> None:
    pacer = Pacer(2 * MS, start_ns=0)
    steps_due(pacer, 1000 * MS)
    assert steps_due(pacer, 1004 * MS) == 2


def test_it_rests_as_long_as_a_step_took_and_catches_up_in_between() -> None:
    pacer = Pacer(2 * MS, start_ns=0)
    assert pacer.due(10 * MS)
    pacer.stepped()
    pacer.rest(10 * MS, 11 * MS)
    assert pacer.wait_ns(11 * MS) == MS
    assert [pacer.due(wall) for wall in (11 * MS, 12 * MS)] == [False, True]
    assert pacer.slipped_ns == 0


def test_a_computer_that_is_too_slow_keeps_half_of_its_time() -> None:
    pacer, wall_ns, steps = Pacer(2 * MS, start_ns=0), 0, 0
    while wall_ns < 1000 * MS:
        wall_ns += pacer.wait_ns(wall_ns)
        if pacer.due(wall_ns):
            wall_ns += 2 * MS
            pacer.stepped()
            pacer.rest(wall_ns - 2 * MS, wall_ns)
            steps += 1
    assert steps == 251
    assert pacer.slipped_ns == pytest.approx(480 * MS, rel=0.02)


def test_a_step_that_was_held_up_is_followed_by_a_period_of_rest_at_most() -> None:
    pacer = Pacer(2 * MS, start_ns=0)
    assert pacer.due(0)
    pacer.stepped()
    pacer.rest(0, 300 * MS)
    assert pacer.wait_ns(300 * MS) == 2 * MS


def test_the_real_time_factor_is_that_of_the_last_whole_window() -> None:
    factor = RealTimeFactor(wall_ns=0, now_ns=0)
    factor.update(500 * MS, 100 * MS)
    assert factor.value == 1.0
    factor.update(1000 * MS, 500 * MS)
    assert factor.value == 0.5


def test_the_furthest_behind_is_remembered_until_it_is_forgotten() -> None:
    pacer = Pacer(2 * MS, start_ns=0)
    steps_due(pacer, 35 * MS)
    steps_due(pacer, 37 * MS)
    assert pacer.worst_lag_ns == 35 * MS
    pacer.worst_lag_ns = 0
    steps_due(pacer, 40 * MS)
    assert pacer.worst_lag_ns < 10 * MS
