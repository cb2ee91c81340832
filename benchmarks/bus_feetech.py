"""Measure one cycle of six FEETECH servos against the peers, and ours on a paced wire.

A cycle reads 10 bytes of every servo (position, speed, load, voltage, temperature, errors) and
writes a goal to every servo. The peers are the vendor's SDK and rustypot, called as their own
examples call them; `bench bus` says what is asked of each client, and what ours does on top.
"""

import statistics
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from struct import Struct
from typing import Any, Final

import numpy as np

from benchmarks.bus_clients import REPLY_MARGIN_S, BusClient
from benchmarks.bus_paced import free_run_s, warm_up
from benchmarks.bus_rounds import BusRound, run_whole_round
from benchmarks.emulated_bus import BITS_PER_BYTE, emulated_bus
from drivers.clock import MonotonicClock
from drivers.feetech.bus import FeetechBus
from drivers.feetech.servo import FeetechServo
from drivers.serial_port import SerialPort
from sim_twin.harness.cores import own_core, realtime

SERVOS: Final = 6
MODEL: Final = "STS3215-C018"
_BAUD: Final = 1_000_000
_BLOCK: Final = (56, 10)
_GOAL: Final = (42, 2)
_GOAL_STEP: Final = 2048
_NO_HEALTH_POLL: Final = 1_000_000  # the peers do not do it
_WIRE_BYTES: Final = (8 + SERVOS) + SERVOS * 16 + (8 + 3 * SERVOS)
"""Sync read, statuses, sync write."""
_SERVER: Final = ("--family", "feetech", "--servos", str(SERVOS), "--models", MODEL)
_unpack: Final = Struct("<HHHBBBB").unpack
PEERS: Final = ("scservo_sdk", "rustypot")

Cycle = Callable[[], None]


@contextmanager
def _ours(link: Path, baud: int, fast: bool) -> Iterator[Cycle]:
    del fast
    clock = MonotonicClock()
    servos = [
        FeetechServo(id=n, model_name=MODEL, joint=f"joint_{n}") for n in range(1, SERVOS + 1)
    ]
    bus = FeetechBus(
        SerialPort(link, baud, clock),
        clock,
        servos,
        baud=baud,
        reply_margin_s=REPLY_MARGIN_S,
        health_every_cycles=_NO_HEALTH_POLL,
    )
    bus.connect()
    goals = np.zeros(SERVOS)

    def cycle() -> None:
        bus.read_state()
        if bus.counters.partial_cycles:
            raise RuntimeError("drivers.feetech: a servo gave no value; the bus is not in order")
        bus.write_goals(goals)

    try:
        yield cycle
    finally:
        bus.close()


@contextmanager
def _sdk(link: Path, baud: int, fast: bool) -> Iterator[Cycle]:
    import scservo_sdk as sdk

    del fast
    port = sdk.PortHandler(str(link))
    port.openPort()
    port.setBaudRate(baud)
    handler = sdk.PacketHandler(0)
    read = sdk.GroupSyncRead(port, handler, *_BLOCK)
    write = sdk.GroupSyncWrite(port, handler, *_GOAL)
    ids = range(1, SERVOS + 1)
    for servo_id in ids:
        read.addParam(servo_id)
        write.addParam(servo_id, [0, 8])

    def cycle() -> None:
        if read.txRxPacket() != sdk.COMM_SUCCESS:
            raise RuntimeError("feetech-servo-sdk: a servo gave no value; the bus is not in order")
        for servo_id in ids:
            for address, sign_bit in ((56, 15), (58, 15), (60, 10)):
                _signed(read.getData(servo_id, address, 2), sign_bit)
            for address in (62, 63, 65):
                read.getData(servo_id, address, 1)
            write.changeParam(servo_id, list(_GOAL_STEP.to_bytes(2, "little")))
        write.txPacket()

    try:
        yield cycle
    finally:
        port.closePort()


@contextmanager
def _rustypot(link: Path, baud: int, fast: bool) -> Iterator[Cycle]:
    import rustypot

    del fast
    bus = rustypot.Sts3215PyController(str(link), baud, REPLY_MARGIN_S)
    ids = list(range(1, SERVOS + 1))

    def cycle() -> None:
        for data in bus.sync_read_raw_data(ids, *_BLOCK):
            position, speed, load, *_ = _unpack(bytes(data))
            _signed(position, 15), _signed(speed, 15), _signed(load, 10)
        goals = [list(_GOAL_STEP.to_bytes(2, "little")) for _ in ids]
        bus.sync_write_raw_data(ids, _GOAL[0], goals)

    try:
        yield cycle
    finally:
        bus.close()


def _signed(value: int, sign_bit: int) -> int:
    magnitude = value & ((1 << sign_bit) - 1)
    return -magnitude if value >> sign_bit & 1 else magnitude


_CLIENTS: Final = (
    BusClient(name="ours", fast=False, open=_ours),
    BusClient(name="scservo_sdk", fast=False, open=_sdk),
    BusClient(name="rustypot", fast=False, open=_rustypot),
)


def measure_feetech(rounds: int, seconds: float) -> dict[str, Any]:
    """Run all clients in turn, then ours on a paced bus; return medians, ratios and every round.

    Raises:
        RuntimeError: the emulated servos did not come up, or a servo gave no value.
    """
    results: dict[str, list[BusRound]] = {client.name: [] for client in _CLIENTS}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        with emulated_bus(folder, _SERVER) as link, own_core():
            for _ in range(rounds):
                for client in _CLIENTS:
                    results[client.name].append(run_whole_round(client, link, _BAUD, seconds))
        paced = _measure_paced(folder, rounds, seconds)
    cpu_us = {
        client: statistics.median(one.cpu_us_per_cycle for one in done)
        for client, done in results.items()
    }
    rates = {
        client: statistics.median(one.cycles_per_s for one in done)
        for client, done in results.items()
    }
    return {
        "cpu_ratio_vs_scservo_sdk": cpu_us["ours"] / cpu_us["scservo_sdk"],
        "cpu_ratio_vs_rustypot": cpu_us["ours"] / cpu_us["rustypot"],
        **paced,
        "servos": SERVOS,
        "clients": {
            client: {
                "cpu_us_per_cycle": cpu_us[client],
                "cycles_per_s": rates[client],
                "wire_bytes_per_cycle": _WIRE_BYTES,
                "rounds_cpu_us": [one.cpu_us_per_cycle for one in done],
            }
            for client, done in results.items()
        },
    }


def _measure_paced(folder: Path, rounds: int, seconds: float) -> dict[str, Any]:
    """Return how long a cycle takes at 1 Mbit/s beside its bytes alone, as `bus_paced` does."""
    wire_s = _WIRE_BYTES * BITS_PER_BYTE / _BAUD
    with (
        emulated_bus(folder, _SERVER, _BAUD) as link,
        realtime() as permitted,
        _ours(link, _BAUD, fast=False) as cycle,
    ):
        warm_up(cycle)
        ratios = [free_run_s(cycle, seconds) / wire_s for _ in range(rounds)]
    return {
        "cycle_time_ratio_vs_wire_limit": min(ratios),
        "cycle_time_ratio_vs_wire_limit_median": statistics.median(ratios),
        "paced_realtime": permitted,
    }
