"""Injections must cover every process and signal; a few of them run for real."""

from collections import Counter

from sim_twin.campaigns.kills import RULES, SIGNALS, injections


def test_every_process_gets_every_signal() -> None:
    processes = {process for process, _ in RULES}
    assert set(RULES) == {(process, number) for process in processes for number in SIGNALS}


def test_two_hundred_injections_take_all_pairs_about_equally_often() -> None:
    drawn = injections(200, seed=3)
    counts = Counter((each.process, each.signal) for each in drawn)
    assert len(drawn) == 200
    assert set(counts) == set(RULES)
    assert max(counts.values()) - min(counts.values()) <= 1


def test_the_same_seed_draws_the_same_and_another_one_others() -> None:
    assert injections(30, seed=1) == injections(30, seed=1)
    assert injections(30, seed=1) != injections(30, seed=2)
