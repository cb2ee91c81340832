"""Measure the CPU of one 16-servo cycle against the vendor's SDK, over the same emulated bus.

A cycle reads 10 bytes of every servo (current, velocity, position), decodes them, and writes a
4-byte goal to every servo. The bus is a pseudo-terminal served by another process, without pacing.
Rounds of the clients take turns, so that a busy machine hits all of them; medians are compared.
"""

import argparse
import json
import signal
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Final

import numpy as np

from drivers.clock import NS_PER_S, MonotonicClock
from drivers.dynamixel import DynamixelBus, ServoSpec
from drivers.serial_port import SerialPort

_SERVOS: Final = 16
_MODEL: Final = "XM430-W350"
_BAUD: Final = 1_000_000
_BITS_PER_BYTE: Final = 10
_WARM_UP_CYCLES: Final = 20
_START_PATIENCE_S: Final = 15.0
_REPLY_MARGIN_S: Final = 0.1  # the emulator shares the machine; this is no measure of it
_WRITE_BYTES: Final = 94
_READ_BYTES: Final = {False: 30 + 16 * 21, True: 30 + 8 + 16 * 14}


@dataclass(frozen=True, slots=True, kw_only=True)
class Round:
    """Hold what one client did in one round."""

    cycles: int
    cpu_us_per_cycle: float
    cycles_per_s: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Client:
    """Name a client; `open` yields the function that runs one cycle."""

    name: str
    fast: bool
    open: Callable[[Path, bool], Any]


@contextmanager
def _ours(link: Path, fast: bool) -> Iterator[Callable[[], None]]:
    clock = MonotonicClock()
    bus = DynamixelBus(
        SerialPort(link, _BAUD, clock),
        clock,
        [ServoSpec(id=n, model_name=_MODEL, joint=f"joint_{n}") for n in range(1, _SERVOS + 1)],
        baud=_BAUD,
        fast_sync=fast,
        reply_margin_s=_REPLY_MARGIN_S,
        health_every_cycles=1_000_000,  # the peer does not do it
    )
    bus.connect()
    goals = np.zeros(_SERVOS)

    def cycle() -> None:
        state = bus.read_state()
        if not state.valid.all():
            raise RuntimeError("drivers.dynamixel: a servo gave no value; the bus is not in order")
        bus.write_goals(goals)

    try:
        yield cycle
    finally:
        bus.close()


@contextmanager
def _sdk(link: Path, fast: bool) -> Iterator[Callable[[], None]]:
    import dynamixel_sdk as sdk

    port = sdk.PortHandler(str(link))
    port.openPort()
    port.setBaudRate(_BAUD)
    handler = sdk.PacketHandler(2.0)
    read = sdk.GroupSyncRead(port, handler, 126, 10)
    write = sdk.GroupSyncWrite(port, handler, 116, 4)
    ids = range(1, _SERVOS + 1)
    for servo_id in ids:
        read.addParam(servo_id)
        write.addParam(servo_id, [0, 8, 0, 0])
    transact = read.fastSyncRead if fast else read.txRxPacket

    def cycle() -> None:
        if transact() != sdk.COMM_SUCCESS:
            raise RuntimeError("dynamixel-sdk: a servo gave no value; the bus is not in order")
        for servo_id in ids:
            _signed(read.getData(servo_id, 126, 2), 16)
            _signed(read.getData(servo_id, 128, 4), 32)
            _signed(read.getData(servo_id, 132, 4), 32)
            write.changeParam(servo_id, [0, 8, 0, 0])
        write.txPacket()

    try:
        yield cycle
    finally:
        port.closePort()


def _signed(value: int, bits: int) -> int:
    return value - (1 << bits) if value >> (bits - 1) else value


CLIENTS: Final = (
    Client(name="ours", fast=False, open=_ours),
    Client(name="dynamixel_sdk", fast=False, open=_sdk),
    Client(name="ours_fast", fast=True, open=_ours),
    Client(name="dynamixel_sdk_fast", fast=True, open=_sdk),
)


@contextmanager
def _emulated_bus(folder: Path) -> Iterator[Path]:
    link = folder / "servos"
    command = [sys.executable, "-m", "sim_twin.servos", "--link", str(link)]
    command += ["--servos", str(_SERVOS), "--models", _MODEL]
    with subprocess.Popen(command) as server:
        try:
            _wait_for(link, server)
            yield link
        finally:
            server.send_signal(signal.SIGTERM)


def _wait_for(link: Path, server: subprocess.Popen[bytes]) -> None:
    clock = MonotonicClock()
    deadline_ns = clock.now_ns() + round(_START_PATIENCE_S * NS_PER_S)
    while not link.exists():
        if server.poll() is not None or clock.now_ns() > deadline_ns:
            raise RuntimeError(
                f"the emulated servos did not come up within {_START_PATIENCE_S} s; "
                "try `python -m sim_twin.servos --link /tmp/servos`"
            )
        clock.sleep_until(clock.now_ns() + NS_PER_S // 50)


def _run_round(client: Client, link: Path, seconds: float) -> Round:
    with client.open(link, client.fast) as cycle:
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
    return Round(
        cycles=cycles,
        cpu_us_per_cycle=cpu_ns / 1e3 / cycles,
        cycles_per_s=cycles * NS_PER_S / wall_ns,
    )


def measure(rounds: int, seconds: float) -> dict[str, Any]:
    """Run all clients in turn and return medians, ratios and every round.

    Raises:
        RuntimeError: the emulated servos did not come up, or a servo gave no value.
    """
    results: dict[str, list[Round]] = {client.name: [] for client in CLIENTS}
    with tempfile.TemporaryDirectory() as folder, _emulated_bus(Path(folder)) as link:
        for _ in range(rounds):
            for client in CLIENTS:
                results[client.name].append(_run_round(client, link, seconds))
    return _report(results)


def _report(results: dict[str, list[Round]]) -> dict[str, Any]:
    cpu_us = {
        name: statistics.median(one.cpu_us_per_cycle for one in rounds)
        for name, rounds in results.items()
    }
    rate = {
        name: statistics.median(one.cycles_per_s for one in rounds)
        for name, rounds in results.items()
    }
    return {
        "cpu_ratio_vs_dynamixel_sdk": cpu_us["ours"] / cpu_us["dynamixel_sdk"],
        "cpu_ratio_vs_dynamixel_sdk_fast": cpu_us["ours_fast"] / cpu_us["dynamixel_sdk_fast"],
        "cycles_per_s": rate["ours"],
        "servos": _SERVOS,
        "clients": {
            client.name: {
                "cpu_us_per_cycle": cpu_us[client.name],
                "cycles_per_s": rate[client.name],
                "wire_bytes_per_cycle": _READ_BYTES[client.fast] + _WRITE_BYTES,
                "wire_ms_at_1_mbps": (_READ_BYTES[client.fast] + _WRITE_BYTES)
                * _BITS_PER_BYTE
                / 1000,
                "rounds_cpu_us": [one.cpu_us_per_cycle for one in results[client.name]],
            }
            for client in CLIENTS
        },
    }


def _text(report: dict[str, Any]) -> str:
    lines = [
        f"{name:20} {values['cpu_us_per_cycle']:8.1f} us CPU per cycle"
        f" {values['cycles_per_s']:8.0f} cycles/s"
        f" {values['wire_bytes_per_cycle']:5d} bytes on the wire"
        for name, values in report["clients"].items()
    ]
    lines.append(
        f"our CPU is {report['cpu_ratio_vs_dynamixel_sdk']:.2f} of dynamixel-sdk's, "
        f"with fast sync read {report['cpu_ratio_vs_dynamixel_sdk_fast']:.2f}"
    )
    return "\n".join(lines)


def main(argv: Sequence[str] | None = None) -> int:
    """Print the comparison; exit 2 where the SDK is not installed, 1 where the bus fails."""
    parser = argparse.ArgumentParser(prog="bench bus", description=__doc__)
    parser.add_argument("--rounds", type=int, default=5, help="interleaved rounds per client")
    parser.add_argument("--seconds", type=float, default=0.8, help="length of one round")
    parser.add_argument("--json", action="store_true", help="print JSON")
    options = parser.parse_args(argv)
    if find_spec("dynamixel_sdk") is None:
        print("bench bus: dynamixel-sdk is missing; pip install 'vla-deploy[dev]'", file=sys.stderr)
        return 2
    try:
        report = measure(options.rounds, options.seconds)
    except RuntimeError as error:
        print(f"bench bus: {error}", file=sys.stderr)
        return 1
    print(json.dumps(report, indent=2) if options.json else _text(report))
    return 0


if __name__ == "__main__":
    sys.exit(main())
