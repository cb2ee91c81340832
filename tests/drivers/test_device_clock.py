from hypothesis import given
from hypothesis import strategies as st

from drivers.device_clock import RESTART_NS, WINDOW_NS, DeviceClock

MS = 1_000_000


def test_the_least_latency_counts() -> None:
    clock = DeviceClock()
    assert clock.to_host_ns(0, 30 * MS) == 30 * MS
    assert clock.to_host_ns(100 * MS, 105 * MS) == 105 * MS
    assert clock.to_host_ns(200 * MS, 290 * MS) == 205 * MS


@given(st.lists(st.integers(0, 80), min_size=1, max_size=60))
def test_no_stamp_lies_in_the_future_of_its_arrival(latencies_ms: list[int]) -> None:
    clock = DeviceClock()
    for i, latency_ms in enumerate(latencies_ms):
        arrival_ns = (1000 + 50 * i + latency_ms) * MS
        assert clock.to_host_ns(50 * i * MS, arrival_ns) <= arrival_ns


def test_a_wrapping_counter_goes_on() -> None:
    clock = DeviceClock(wrap_ns=30_000 * MS)
    assert clock.to_host_ns(29_990 * MS, 100 * MS) == 100 * MS
    assert clock.to_host_ns(0, 115 * MS) == 110 * MS
    assert clock.to_host_ns(10 * MS, 120 * MS) == 120 * MS


def test_a_slow_drift_is_followed_after_two_windows() -> None:
    clock = DeviceClock()
    step_ns, host_ns, device_ns, mapped = 100 * MS, 0, 0, 0
    for _ in range(3 * WINDOW_NS // step_ns):
        host_ns += step_ns + 50_000  # the device's clock runs 500 ppm slow
        device_ns += step_ns
        mapped = clock.to_host_ns(device_ns, host_ns)
    assert host_ns - mapped < 2.1 * 500e-6 * WINDOW_NS


def test_the_offset_is_measured_again_after_a_gap() -> None:
    clock = DeviceClock()
    clock.to_host_ns(5_000 * MS, 1_000 * MS)
    late_ns = 1_100 * MS + 3 * RESTART_NS
    assert clock.to_host_ns(5_100 * MS, late_ns) == late_ns
