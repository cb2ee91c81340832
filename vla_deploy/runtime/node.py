"""Declare the shape of a robot process: robot and lock-step twin step the same code."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol, TypeVar, runtime_checkable

from drivers.clock import NS_PER_S, Clock
from platforms import Profile

PreparedT = TypeVar("PreparedT")


class Node(Protocol):
    """Do one process' work in steps of a fixed period; IO happens inside `step`, never a sleep."""

    @property
    def period_s(self) -> float:
        """Return the time between two steps."""
        ...

    def start(self) -> None:
        """Open devices and topics."""
        ...

    def step(self) -> None:
        """Do one period's work with the clock the node was built with."""
        ...

    def stop(self) -> None:
        """Leave devices safe and close them; called once, also when `start` failed half way."""
        ...


class NeedsRestart(Exception):
    """Say why a node cannot take over a profile while it runs, but a fresh one can."""


@runtime_checkable
class Adaptable(Protocol[PreparedT]):
    """Take over another profile between two steps; a node without this has nothing to change."""

    def prepare(self, profile: Profile, model_tier: int) -> PreparedT:
        """Build what the profile asks for, its models `model_tier` steps below the best.

        May take long and runs beside `step`, in another thread: it reads nothing that steps write.

        Raises:
            NeedsRestart: only a fresh process can do so.
        """
        ...

    def commit(self, prepared: PreparedT) -> PreparedT:
        """Switch over at once and return what was replaced: committing that is the way back."""
        ...

    def discard(self, prepared: PreparedT) -> None:
        """Release what is not needed: never committed, or replaced for good."""
        ...


@runtime_checkable
class Slowable(Protocol):
    """Do costly work more seldom where the budgets ask for it; steps are paced by their caller."""

    def slow(self, rate_ratio: float) -> None:
        """Do the costly part of the work at this share of the profile's rate from now on."""
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

    The period may change with every step. `stop` follows also when `start` or `step` fails.
    """
    try:
        node.start()
        deadline_ns = clock.now_ns()
        while not should_stop():
            node.step()
            period_ns = round(node.period_s * NS_PER_S)
            deadline_ns = max(deadline_ns + period_ns, clock.now_ns())
            clock.sleep_until(deadline_ns)
    finally:
        node.stop()
