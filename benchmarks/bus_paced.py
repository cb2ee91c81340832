"""Measure our client on a bus whose bytes take their time, as on a real wire.

Where the machine permits, the client has the real-time scheduling with which control runs on the
robot (`paced_realtime` tells); the emulated servos have it too, being in the place of hardware.
All figures come from several rounds. Another process that holds the processor can only lengthen a
cycle, never shorten it, so the least disturbed round tells what the client is capable of: its
median cycle, the best rate reached, and the least share of a core. The median over all rounds
stands beside them under `..._median`. `core_share_bare_sleep_100hz` is what it costs on this
machine to wake once a period and do nothing, and a cycle wakes about three times: on an idle
virtual machine that is most of its share. A rate asked for is never exceeded, so a little more than
the bar is asked for.
"""

import statistics
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

from benchmarks.bus_clients import ours
from benchmarks.emulated_bus import SERVER, emulated_bus, wire_s
from drivers.clock import NS_PER_S, MonotonicClock
from sim_twin.harness.cores import realtime

SHARE_HZ: Final = 100
ASKED_HZ: Final = {1_000_000: 205, 3_000_000: 510}
_WARM_UP_CYCLES: Final = 20

Cycle = Callable[[], None]


def measure_paced(folder: Path, rounds: int, seconds: float) -> dict[str, Any]:
    """Return core share, cycle time beside the wire's, and the rates reached.

    Raises:
        RuntimeError: the emulated servos did not come up, or a servo gave no value.
    """
    report: dict[str, Any] = {}
    for baud in ASKED_HZ:
        with emulated_bus(folder, SERVER, baud) as link, realtime() as permitted:
            report |= _at(link, baud, rounds, seconds) | {"paced_realtime": permitted}
            bare = [_at_rate(_do_nothing, SHARE_HZ, seconds)[1] for _ in range(rounds)]
            report[f"core_share_bare_sleep_{SHARE_HZ}hz"] = min(bare)
    ratios = [report[f"cycle_time_ratio_{baud // 1_000_000}mbps"] for baud in ASKED_HZ]
    return report | {"cycle_time_ratio_vs_wire_limit": max(ratios)}


def _at(link: Path, baud: int, rounds: int, seconds: float) -> dict[str, Any]:
    name = f"{baud // 1_000_000}mbps"
    with ours(link, baud, True) as cycle:
        warm_up(cycle)
        results = [
            (
                _at_rate(cycle, SHARE_HZ, seconds)[1],
                _at_rate(cycle, ASKED_HZ[baud], seconds)[0],
                free_run_s(cycle, seconds) / wire_s(baud, fast=True),
            )
            for _ in range(rounds)
        ]
    with ours(link, baud, False) as cycle:
        warm_up(cycle)
        plain = [_at_rate(cycle, SHARE_HZ, seconds)[1] for _ in range(rounds)]
    shares, rates, ratios = zip(*results, strict=True)
    return {
        f"core_share_{name}_{SHARE_HZ}hz": min(shares),
        f"core_share_{name}_{SHARE_HZ}hz_median": statistics.median(shares),
        f"core_share_{name}_{SHARE_HZ}hz_plain_sync": min(plain),
        f"reached_hz_{name}": max(rates),
        f"reached_hz_{name}_median": statistics.median(rates),
        f"cycle_time_ratio_{name}": min(ratios),
        f"cycle_time_ratio_{name}_median": statistics.median(ratios),
    }


def _do_nothing() -> None:
    """Leave the period to its sleep."""


def warm_up(cycle: Cycle) -> None:
    """Run a few cycles that do not count."""
    for _ in range(_WARM_UP_CYCLES):
        cycle()


def _at_rate(cycle: Cycle, rate_hz: int, seconds: float) -> tuple[float, float]:
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


def free_run_s(cycle: Cycle, seconds: float) -> float:
    """Return the median time of a cycle that follows the one before at once."""
    times_ns = []
    end_ns = time.monotonic_ns() + round(seconds * NS_PER_S)
    before_ns = time.monotonic_ns()
    while before_ns < end_ns:
        cycle()
        now_ns = time.monotonic_ns()
        times_ns.append(now_ns - before_ns)
        before_ns = now_ns
    return statistics.median(times_ns) / NS_PER_S
