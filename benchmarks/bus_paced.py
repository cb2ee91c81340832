"""Measure our client on a bus whose bytes take their time, as on a real wire."""

import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

from benchmarks.bus_clients import ours
from benchmarks.emulated_bus import emulated_bus, wire_s
from drivers.clock import NS_PER_S, MonotonicClock

SHARE_HZ: Final = 100
ASKED_HZ: Final = {1_000_000: 200, 3_000_000: 500}
_WARM_UP_CYCLES: Final = 20


def measure_paced(folder: Path, seconds: float) -> dict[str, Any]:
    """Return core share, cycle time beside the wire's, and the rates reached.

    Raises:
        RuntimeError: the emulated servos did not come up, or a servo gave no value.
    """
    report: dict[str, Any] = {}
    for baud, asked_hz in ASKED_HZ.items():
        with emulated_bus(folder, baud) as link:
            report |= _at(link, baud, asked_hz, seconds)
    ratios = [report[f"cycle_time_ratio_{baud // 1_000_000}mbps"] for baud in ASKED_HZ]
    return report | {"cycle_time_ratio_vs_wire_limit": max(ratios)}


def _at(link: Path, baud: int, asked_hz: int, seconds: float) -> dict[str, Any]:
    name = f"{baud // 1_000_000}mbps"
    figures: dict[str, Any] = {}
    with ours(link, baud, True) as cycle:
        _warm_up(cycle)
        figures[f"core_share_{name}_{SHARE_HZ}hz"] = _at_rate(cycle, SHARE_HZ, seconds)[1]
        figures[f"reached_hz_{name}"] = _at_rate(cycle, asked_hz, seconds)[0]
        free_s = _free_run_s(cycle, seconds)
        figures[f"cycle_time_ratio_{name}"] = free_s / wire_s(baud, fast=True)
    with ours(link, baud, False) as cycle:
        _warm_up(cycle)
        figures[f"core_share_{name}_{SHARE_HZ}hz_plain_sync"] = _at_rate(cycle, SHARE_HZ, seconds)[
            1
        ]
    return figures


def _warm_up(cycle: Callable[[], None]) -> None:
    for _ in range(_WARM_UP_CYCLES):
        cycle()


def _at_rate(cycle: Callable[[], None], rate_hz: int, seconds: float) -> tuple[float, float]:
    """Run cycles at absolute deadlines; return the rate reached and the share of a core used."""
    clock = MonotonicClock()
    count = max(1, round(seconds * rate_hz))
    period_ns = NS_PER_S // rate_hz
    cpu_ns = time.process_time_ns()
    start_ns = clock.now_ns()
    for number in range(1, count + 1):
        cycle()
        clock.sleep_until(start_ns + number * period_ns)
    wall_ns = clock.now_ns() - start_ns
    cpu_ns = time.process_time_ns() - cpu_ns
    return count * NS_PER_S / wall_ns, cpu_ns / wall_ns


def _free_run_s(cycle: Callable[[], None], seconds: float) -> float:
    """Return the median time of a cycle that follows the one before at once."""
    times_ns = []
    end_ns = time.monotonic_ns() + round(seconds * NS_PER_S)
    before_ns = time.monotonic_ns()
    while before_ns < end_ns:
        cycle()
        now_ns = time.monotonic_ns()
        times_ns.append(now_ns - before_ns)
        before_ns = now_ns
    return sorted(times_ns)[len(times_ns) // 2] / NS_PER_S
