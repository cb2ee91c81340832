"""Back-off, breaker, admission, deadline, metrics: each alone, on a stepped clock."""

import threading

import pytest

from drivers.clock import NS_PER_S, MonotonicClock
from vla_deploy.model_servers.calls.limits import (
    Admission,
    Backoff,
    BreakerState,
    CallRate,
    CircuitBreaker,
    bounded_s,
    may_pass,
)
from vla_deploy.model_servers.chat import Completion
from vla_deploy.model_servers.errors import (
    AnswerInvalid,
    Busy,
    CircuitOpen,
    ServerFailed,
    ServerUnreachable,
    TimedOut,
)
from vla_deploy.model_servers.metrics import CallMetrics
from vla_deploy.runtime.deadline import Deadline


def test_the_wait_is_jittered_over_a_bound_that_doubles_up_to_the_longest():
    bounds = [
        Backoff(first_s=0.5, longest_s=3.0, draw=lambda: 1.0).wait_s(n, _failed())
        for n in range(1, 6)
    ]
    assert bounds == [0.5, 1.0, 2.0, 3.0, 3.0]
    assert Backoff(first_s=0.5, longest_s=3.0, draw=lambda: 0.0).wait_s(3, _failed()) == 0.0


def test_the_wait_is_never_shorter_than_the_server_asks():
    assert Backoff(first_s=0.5, longest_s=3.0, draw=lambda: 1.0).wait_s(1, _failed(7.0)) == 7.0


def _failed(wait_s: float | None = None) -> ServerFailed:
    return ServerFailed("HTTP 503", 503, wait_s)


@pytest.mark.parametrize(
    ("error", "expected"),
    [
        (_failed(), True),
        (ServerUnreachable("refused", was_sent=False), True),
        (ServerUnreachable("broke", was_sent=True), False),
        (TimedOut("late"), False),
        (AnswerInvalid(("name",)), False),
    ],
)
def test_only_what_was_not_carried_out_is_tried_again(error, expected):
    assert may_pass(error) is expected


def test_a_breaker_opens_after_failures_in_a_row_and_tries_one_request_later(clock):
    breaker = CircuitBreaker(2, 30.0, clock)
    breaker.failed()
    breaker.succeeded()
    breaker.failed()
    assert breaker.state is BreakerState.CLOSED
    breaker.failed()
    with pytest.raises(CircuitOpen, match=r"2 failures.*30\.0 s"):
        breaker.admit()
    clock.time_ns += 30 * NS_PER_S
    assert breaker.state is BreakerState.HALF_OPEN
    breaker.admit()
    with pytest.raises(CircuitOpen, match="on trial"):
        breaker.admit()


def test_the_trial_decides(clock):
    breaker = CircuitBreaker(1, 30.0, clock)
    breaker.failed()
    clock.time_ns += 30 * NS_PER_S
    breaker.admit()
    breaker.failed()
    assert breaker.state is BreakerState.OPEN
    clock.time_ns += 30 * NS_PER_S
    breaker.admit()
    breaker.abandoned()
    breaker.admit()
    breaker.succeeded()
    assert breaker.state is BreakerState.CLOSED


def test_calls_beyond_the_bound_wait_and_those_beyond_the_queue_are_refused():
    admission = Admission(max_calls=1, max_waiting=1)
    ends = Deadline.within(MonotonicClock(), 5.0)
    got_in = threading.Event()

    def wait_for_a_place() -> None:
        with admission.place(ends):
            got_in.set()

    with admission.place(ends):
        waiter = threading.Thread(target=wait_for_a_place)
        waiter.start()
        while admission.waiting == 0 and waiter.is_alive():
            got_in.wait(0.001)
        with pytest.raises(Busy, match="1 calls under way and 1 wait"), admission.place(ends):
            pass
        assert not got_in.is_set()
    assert got_in.wait(5.0)
    waiter.join()
    assert (admission.active, admission.waiting) == (0, 0)


def test_a_place_that_comes_too_late_is_none():
    admission = Admission(max_calls=1, max_waiting=1)
    ends = Deadline.within(MonotonicClock(), 0.01)
    with (
        admission.place(ends),
        pytest.raises(TimedOut, match=r"no place within 0\.01 s"),
        admission.place(ends),
    ):
        pass
    assert (admission.active, admission.waiting) == (0, 0)


def test_a_deadline_bounds_every_wait_by_what_is_left(clock):
    ends = Deadline.within(clock, 2.0)
    assert (bounded_s(ends), bounded_s(ends, 0.5), bounded_s(ends, 9.0)) == (2.0, 0.5, 2.0)
    clock.time_ns += 2 * NS_PER_S
    with pytest.raises(TimedOut, match="within 2 s"):
        bounded_s(ends, 0.5)


def test_metrics_count_calls_tokens_and_times():
    metrics = CallMetrics()
    assert metrics.document()["latency_p95_s"] is None
    for n in range(1, 101):
        metrics.answered(Completion(text="", tokens_in=10, tokens_out=None), n / 100)
    metrics.failed(TimedOut("late"))
    metrics.retried()
    told = metrics.document()
    assert (told["calls"], told["answers"], told["retries"]) == (101, 100, 1)
    assert (told["tokens_in"], told["tokens_out"]) == (1000, 0)
    assert told["failures"] == {"TimedOut": 1}
    assert told["latency_p50_s"] == pytest.approx(0.5, abs=0.01)
    assert told["latency_p95_s"] == pytest.approx(0.95, abs=0.01)


def test_calls_are_counted_over_the_last_minute(clock):
    rate = CallRate(2, clock)
    rate.take()
    clock.time_ns += 30 * NS_PER_S
    rate.take()
    with pytest.raises(Busy, match=r"2 calls in the last minute.*the next one in 30 s"):
        rate.take()
    clock.time_ns += 30 * NS_PER_S
    rate.take()
    with pytest.raises(Busy):
        rate.take()
