from drivers.clock import NS_PER_S
from vla_deploy.runtime.rate_monitor import RateMonitor, TrialMonitor


def test_the_pace_of_late_is_the_share_of_steps_that_were_made() -> None:
    pace = RateMonitor()
    assert pace.ratio == 1.0
    for step in range(1000):
        pace.note(step * NS_PER_S // 10, period_s=0.05)
    assert 0.49 < pace.ratio < 0.51


def test_four_of_five_usual_steps_are_enough_and_three_are_not() -> None:
    watch = TrialMonitor(1, 0, usual_hz=5.0)
    for _ in range(3):
        watch.note()
    assert watch.fault(NS_PER_S, 0.2) == "steps at 3.0 Hz, expected 4.0 Hz"
    watch.note()
    assert watch.fault(NS_PER_S, 0.2) == ""


def test_a_second_look_counts_anew() -> None:
    watch = TrialMonitor(1, 0, usual_hz=5.0)
    watch.again(NS_PER_S)
    for _ in range(4):
        watch.note()
    assert watch.fault(2 * NS_PER_S, 0.2) == ""


def test_a_trial_shorter_than_a_step_is_not_divided_by_nothing() -> None:
    assert TrialMonitor(1, 0, usual_hz=5.0).fault(0, 0.2) == "steps at 0.0 Hz, expected 4.0 Hz"
