"""Open each client of the bus comparison and hand out the function that runs one of its cycles.

A cycle reads 10 bytes of each of 16 servos, turns them into current, velocity and position as
signed numbers, and writes a goal, a number too, to each. Each client does as much of that as its
library has a way for, and the least code does the rest: dynamixel-sdk gives unsigned numbers, and
rustypot's raw block gives bytes, which one `struct` call per servo decodes. Both take a goal as
four bytes. Ours does more: it gives and takes SI arrays on the joint side, checks the CRC of every
reply, clamps goals and keeps count of what is missing; the peers do not have to.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from struct import Struct
from typing import Any, Final

import numpy as np

from drivers.clock import MonotonicClock
from drivers.dynamixel import BlockLayout, DynamixelBus, ServoSpec
from drivers.serial_port import SerialPort

SERVOS: Final = 16
MODEL: Final = "XM430-W350"
REPLY_MARGIN_S: Final = 0.1  # the emulator shares the machine; this is no measure of it
_NO_HEALTH_POLL: Final = 1_000_000  # the peers do not do it
_BLOCK: Final = (126, 10)
_GOAL: Final = (116, 4)
_GOAL_PULSE: Final = 2048
_unpack: Final = Struct("<hii").unpack


@dataclass(frozen=True, slots=True, kw_only=True)
class BusClient:
    """Name a client; `open` yields the function that runs one cycle."""

    name: str
    fast: bool
    open: Callable[[Path, int, bool], Any]


@contextmanager
def ours(link: Path, baud: int, fast: bool) -> Iterator[Callable[[], None]]:
    """Open our bus; a cycle in which a servo gives no value raises RuntimeError."""
    clock = MonotonicClock()
    bus = DynamixelBus(
        SerialPort(link, baud, clock),
        clock,
        [ServoSpec(id=n, model_name=MODEL, joint=f"joint_{n}") for n in range(1, SERVOS + 1)],
        baud=baud,
        fast_sync=fast,
        layout=BlockLayout.DIRECT,
        reply_margin_s=REPLY_MARGIN_S,
        health_every_cycles=_NO_HEALTH_POLL,
    )
    bus.connect()
    goals = np.zeros(SERVOS)

    def cycle() -> None:
        bus.read_state()
        if bus.counters.partial_cycles:
            raise RuntimeError("drivers.dynamixel: a servo gave no value; the bus is not in order")
        bus.write_goals(goals)

    try:
        yield cycle
    finally:
        bus.close()


@contextmanager
def _sdk(link: Path, baud: int, fast: bool) -> Iterator[Callable[[], None]]:
    import dynamixel_sdk as sdk

    port = sdk.PortHandler(str(link))
    port.openPort()
    port.setBaudRate(baud)
    handler = sdk.PacketHandler(2.0)
    read = sdk.GroupSyncRead(port, handler, *_BLOCK)
    write = sdk.GroupSyncWrite(port, handler, *_GOAL)
    ids = range(1, SERVOS + 1)
    for servo_id in ids:
        read.addParam(servo_id)
        write.addParam(servo_id, _bytes_of(_GOAL_PULSE))
    transact = read.fastSyncRead if fast else read.txRxPacket

    def cycle() -> None:
        if transact() != sdk.COMM_SUCCESS:
            raise RuntimeError("dynamixel-sdk: a servo gave no value; the bus is not in order")
        for servo_id in ids:
            _signed(read.getData(servo_id, 126, 2), 16)
            _signed(read.getData(servo_id, 128, 4), 32)
            _signed(read.getData(servo_id, 132, 4), 32)
            write.changeParam(servo_id, _bytes_of(_GOAL_PULSE))
        write.txPacket()

    try:
        yield cycle
    finally:
        port.closePort()


@contextmanager
def _rustypot(link: Path, baud: int, fast: bool) -> Iterator[Callable[[], None]]:
    import rustypot

    bus = rustypot.Xl430PyController(str(link), baud, REPLY_MARGIN_S)
    bus.set_fast_sync_read(fast)
    ids = list(range(1, SERVOS + 1))
    goals = [_GOAL_PULSE] * SERVOS

    def cycle() -> None:
        for data in bus.sync_read_raw_data(ids, *_BLOCK):
            _unpack(data)
        bus.sync_write_raw_data(ids, _GOAL[0], [_bytes_of(goal) for goal in goals])

    try:
        yield cycle
    finally:
        bus.close()


def _bytes_of(goal: int) -> list[int]:
    return list(goal.to_bytes(4, "little", signed=True))


def _signed(value: int, bits: int) -> int:
    return value - (1 << bits) if value >> (bits - 1) else value


CLIENTS: Final = (
    BusClient(name="ours", fast=False, open=ours),
    BusClient(name="dynamixel_sdk", fast=False, open=_sdk),
    BusClient(name="rustypot", fast=False, open=_rustypot),
    BusClient(name="ours_fast", fast=True, open=ours),
    BusClient(name="dynamixel_sdk_fast", fast=True, open=_sdk),
    BusClient(name="rustypot_fast", fast=True, open=_rustypot),
)
