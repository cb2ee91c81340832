"""Compare commanded with counted speed over a tenth of a second."""

import pytest

from vla_deploy.control.output.wheel_tracking import WINDOW_NS, WheelTracking

TICK_NS = 4_000_000


def run(tracking: WheelTracking, ticks: int, commanded: float, speed: float, first: int = 0) -> int:
    """Turn the left wheel at a speed, the right one not at all; return the next tick."""
    for tick in range(first, first + ticks):
        angle = speed * tick * TICK_NS / 1e9
        tracking.note(tick * TICK_NS, [commanded, 0.0], [angle, 0.0])
    return first + ticks


def test_nothing_is_told_before_a_whole_window_has_passed() -> None:
    tracking = WheelTracking(2)
    run(tracking, WINDOW_NS // TICK_NS, 3.0, 1.0)
    assert tracking.commanded_rad_s == [0.0, 0.0]
    assert tracking.measured_rad_s == [0.0, 0.0]


def test_both_speeds_are_means_over_the_window() -> None:
    tracking = WheelTracking(2)
    after = run(tracking, 100, 3.0, 1.0)
    assert tracking.commanded_rad_s == pytest.approx([3.0, 0.0])
    assert tracking.measured_rad_s == pytest.approx([1.0, 0.0])
    run(tracking, round(0.5 * WINDOW_NS / TICK_NS), 5.0, 1.0, first=after)
    assert tracking.commanded_rad_s == pytest.approx([4.0, 0.0], abs=0.1)


def test_uneven_ticks_do_not_change_the_means() -> None:
    tracking = WheelTracking(2)
    now_ns = 0
    for step_ns in (4, 1, 9, 4, 2, 30, 1) * 10:
        now_ns += step_ns * 1_000_000
        tracking.note(now_ns, [2.0, -2.0], [2e-9 * now_ns, -2e-9 * now_ns])
    assert tracking.commanded_rad_s == pytest.approx([2.0, -2.0])
    assert tracking.measured_rad_s == pytest.approx([2.0, -2.0])


def test_the_window_stays_short_when_ticks_grow_rare() -> None:
    tracking = WheelTracking(1)
    for now_ms in range(200):
        tracking.note(now_ms * 1_000_000, [1.0], [0.0])
    for now_ms in range(200, 400, 20):
        tracking.note(now_ms * 1_000_000, [5.0], [0.0])
    assert tracking.commanded_rad_s == pytest.approx([5.0])


def test_forgetting_ends_what_was_told() -> None:
    tracking = WheelTracking(2)
    run(tracking, 100, 3.0, 1.0)
    tracking.forget()
    assert tracking.measured_rad_s == [0.0, 0.0]
    run(tracking, 2, 9.0, 9.0, first=200)
    assert tracking.commanded_rad_s == [0.0, 0.0]
