"""Declare the shape of a robot process: robot and lock-step twin step the same code."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from drivers.clock import NS_PER_S, Clock


class Node(Protocol):
    """Do one process' work in steps of a fixed period; IO happens inside `step`, never a sleep."""

    period_s: float

    def start(self) -> None:
        """Open devices and topics."""
        ...

    def step(self) -> None:
        """Do one period's work with the clock the node was built with."""
        ...

    def stop(self) -> None:
        """Leave devices safe and close them; called once, also when `start` failed half way."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class NodeContext:
    """Carry what every process is started with.

    `run_dir` holds the run's shared memory (`ipc/`) and, in twin mode, the twin's devices (`dev/`).
    `devices_dir` replaces each device path of the robot file by `<devices_dir>/<device name>`.
    """

    run_dir: Path
    robot: str
    profile: str
    devices_dir: Path | None
    clock: Clock


def run_node(node: Node, clock: Clock, should_stop: Callable[[], bool]) -> None:
    """Step a node on absolute deadlines until `should_stop()`; skip periods that were missed.

    `stop` follows also when `start` or `step` fails.
    """
    period_ns = round(node.period_s * NS_PER_S)
    try:
        node.start()
        deadline_ns = clock.now_ns()
        while not should_stop():
            node.step()
            deadline_ns = max(deadline_ns + period_ns, clock.now_ns())
            clock.sleep_until(deadline_ns)
    finally:
        node.stop()
