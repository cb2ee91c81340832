import pytest

from benchmarks.speech_stop_listening import Delay, delay_figures


def test_of_delays_it_tells_what_no_faster_computer_would_save() -> None:
    slow, quick = Delay(0.1, 0.5), Delay(0.3, 0.1)
    figures = delay_figures([quick] * 90 + [slow] * 10)
    assert figures == {
        "stop_delay_p50_s": pytest.approx(0.4),
        "stop_delay_p95_s": pytest.approx(0.6),
        "stop_delay_sound_p95_s": pytest.approx(0.3),
    }


def test_where_nothing_was_heard_in_time_there_are_no_delays() -> None:
    assert set(delay_figures([]).values()) == {None}
