"""Run the emulated servos in a process of their own, and know what their wire takes."""

import os
import signal
import subprocess
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Final

from benchmarks.bus_clients import MODEL, SERVOS
from drivers.clock import NS_PER_S, MonotonicClock
from sim_twin.harness.cores import hardware_cores

SERVER: Final = ("--servos", str(SERVOS), "--models", MODEL)
WRITE_BYTES: Final = 94
READ_BYTES: Final = {False: 30 + 16 * 21, True: 30 + 8 + 16 * 14}
BITS_PER_BYTE: Final = 10
_START_PATIENCE_S: Final = 15.0


def wire_s(baud: int, *, fast: bool) -> float:
    """Return how long the bytes of one cycle take on the wire."""
    return (READ_BYTES[fast] + WRITE_BYTES) * BITS_PER_BYTE / baud


@contextmanager
def emulated_bus(folder: Path, words: Sequence[str], baud: int | None = None) -> Iterator[Path]:
    """Serve servos on a pseudo-terminal; with `baud` every byte takes its time.

    `words` are the options that say which servos.

    Raises:
        RuntimeError: the servos did not come up.
    """
    link = folder / f"servos-{baud or 'unpaced'}"
    command = [sys.executable, "-m", "sim_twin.servos", "--link", str(link)]
    command += words
    if baud is not None:
        command += ["--baud", str(baud), "--return-delay-us", "0"]
    with subprocess.Popen(command) as server:
        try:
            _wait_for(link, server)
            if baud is None:  # a client that spins must not share its core
                os.sched_setaffinity(server.pid, hardware_cores())
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
