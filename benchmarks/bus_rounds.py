"""Run one client of a bus comparison for a while."""

import sys
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from benchmarks.bus_clients import BusClient
from drivers.clock import NS_PER_S

_WARM_UP_CYCLES: Final = 20
_MOST_ATTEMPTS: Final = 3


@dataclass(frozen=True, slots=True, kw_only=True)
class BusRound:
    """Hold what one client did in one round."""

    cycles: int
    cpu_us_per_cycle: float
    cycles_per_s: float


def _run_round(client: BusClient, link: Path, baud: int, seconds: float) -> BusRound:
    with client.open(link, baud, client.fast) as cycle:
        for _ in range(_WARM_UP_CYCLES):
            cycle()
        cycles = 0
        cpu_ns = time.process_time_ns()
        start_ns = time.monotonic_ns()
        end_ns = start_ns + round(seconds * NS_PER_S)
        while time.monotonic_ns() < end_ns:
            cycle()
            cycles += 1
        cpu_ns = time.process_time_ns() - cpu_ns
        wall_ns = time.monotonic_ns() - start_ns
    return BusRound(
        cycles=cycles,
        cpu_us_per_cycle=cpu_ns / 1e3 / cycles,
        cycles_per_s=cycles * NS_PER_S / wall_ns,
    )


def run_whole_round(client: BusClient, link: Path, baud: int, seconds: float) -> BusRound:
    """Run a round, anew where a client lost a cycle to a busy machine.

    Raises:
        RuntimeError: a servo gave no value, time after time.
    """
    for _ in range(_MOST_ATTEMPTS - 1):
        try:
            return _run_round(client, link, baud, seconds)
        except RuntimeError as error:
            print(f"bench bus: a round begins anew: {error}", file=sys.stderr)
    return _run_round(client, link, baud, seconds)
