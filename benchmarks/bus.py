"""Measure the CPU of one 16-servo cycle against the peers, and our timing on a paced wire.

A cycle reads 10 bytes of every servo, decodes them into current, velocity and position, and writes
a goal to every servo; what each client does for it is told in `bus_clients`. The bus is a pseudo-
terminal served by another process. Without pacing, client and servos have a core each where there
are two, and rounds of the clients take turns, so that a busy machine hits all of them; medians are
compared, plain sync read with plain, fast with fast. With pacing, every byte takes its time:
`bus_paced`. `--family feetech` does the same with six FEETECH servos: `bus_feetech`.
"""

import statistics
import sys
import tempfile
from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Final

from benchmarks.bus_clients import CLIENTS, SERVOS, BusClient
from benchmarks.bus_feetech import PEERS as FEETECH_PEERS
from benchmarks.bus_feetech import measure_feetech
from benchmarks.bus_paced import measure_paced
from benchmarks.bus_rounds import BusRound, run_whole_round
from benchmarks.command import parser, show
from benchmarks.emulated_bus import READ_BYTES, SERVER, WRITE_BYTES, emulated_bus, wire_s
from sim_twin.harness.cores import own_core

_BAUD: Final = 1_000_000
_RATIOS: Final = {
    "cpu_ratio_vs_dynamixel_sdk": ("ours", "dynamixel_sdk"),
    "cpu_ratio_vs_rustypot": ("ours", "rustypot"),
    "cpu_ratio_vs_dynamixel_sdk_fast": ("ours_fast", "dynamixel_sdk_fast"),
    "cpu_ratio_vs_rustypot_fast": ("ours_fast", "rustypot_fast"),
}
_PEERS: Final = ("dynamixel_sdk", "rustypot")


def measure(rounds: int, seconds: float) -> dict[str, Any]:
    """Run all clients in turn, then ours on a paced bus; return medians, ratios and every round.

    Raises:
        RuntimeError: the emulated servos did not come up, or a servo gave no value.
    """
    results: dict[str, list[BusRound]] = {client.name: [] for client in CLIENTS}
    with tempfile.TemporaryDirectory() as folder:
        with emulated_bus(Path(folder), SERVER) as link, own_core():
            for _ in range(rounds):
                for client in CLIENTS:
                    results[client.name].append(run_whole_round(client, link, _BAUD, seconds))
        return _report(results) | measure_paced(Path(folder), rounds, seconds)


def _report(results: dict[str, list[BusRound]]) -> dict[str, Any]:
    cpu_us = {
        name: statistics.median(one.cpu_us_per_cycle for one in rounds)
        for name, rounds in results.items()
    }
    ratios = {name: cpu_us[ours] / cpu_us[peer] for name, (ours, peer) in _RATIOS.items()}
    clients = {client.name: _client_report(client, results[client.name]) for client in CLIENTS}
    return ratios | {
        "cycles_per_s": clients["ours"]["cycles_per_s"],
        "servos": SERVOS,
        "clients": clients,
    }


def _client_report(client: BusClient, rounds: Sequence[BusRound]) -> dict[str, Any]:
    return {
        "cpu_us_per_cycle": statistics.median(one.cpu_us_per_cycle for one in rounds),
        "cycles_per_s": statistics.median(one.cycles_per_s for one in rounds),
        "wire_bytes_per_cycle": READ_BYTES[client.fast] + WRITE_BYTES,
        "wire_ms_at_1_mbps": wire_s(_BAUD, fast=client.fast) * 1e3,
        "rounds_cpu_us": [one.cpu_us_per_cycle for one in rounds],
    }


def _text(report: dict[str, Any]) -> str:
    lines = [
        f"{name:20} {values['cpu_us_per_cycle']:8.1f} us CPU per cycle"
        f" {values['cycles_per_s']:8.0f} cycles/s"
        f" {values['wire_bytes_per_cycle']:5d} bytes on the wire"
        for name, values in report["clients"].items()
    ]
    lines += [
        f"{name:36} {value:8.3f}" for name, value in report.items() if isinstance(value, float)
    ]
    return "\n".join(lines)


def main(argv: Sequence[str] | None = None) -> int:
    """Print the comparison; exit 2 where a peer is not installed, 1 where the bus fails."""
    arguments = parser("bus", __doc__)
    arguments.add_argument("--rounds", type=int, default=5, help="interleaved rounds per client")
    arguments.add_argument("--seconds", type=float, default=0.8, help="length of one round")
    arguments.add_argument("--family", choices=("dynamixel", "feetech"), default="dynamixel")
    options = arguments.parse_args(argv)
    is_feetech = options.family == "feetech"
    peers = FEETECH_PEERS if is_feetech else _PEERS
    missing = [name for name in peers if find_spec(name) is None]
    if missing:
        print(
            f"bench bus: missing: {', '.join(missing)}; pip install 'vla-deploy[dev]'",
            file=sys.stderr,
        )
        return 2
    try:
        run = measure_feetech if is_feetech else measure
        report = run(options.rounds, options.seconds)
    except RuntimeError as error:
        print(f"bench bus: {error}", file=sys.stderr)
        return 1
    show(report, as_json=options.json, text=_text)
    return 0


if __name__ == "__main__":
    sys.exit(main())
