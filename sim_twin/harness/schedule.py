"""Step nodes by due time on simulated time, in one process and in a repeatable order."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Protocol

from drivers.clock import NS_PER_S
from sim_twin.timing.clock import Simulation
from vla_deploy.runtime.node import Node


class HeldDevice(Protocol):
    """Hold a device open."""

    def close(self) -> None:
        """Release the device."""
        ...


@dataclass(slots=True)
class _Entry:
    node: Node
    due_ns: int
    opened: list[HeldDevice] = field(default_factory=list)


class Schedule:
    """Run the simulation to the next due node, then that node; ties go by order of arrival.

    `opened` is the growing list of transports that nodes have opened: what a node opened is closed
    when it is killed, as the kernel does for a dead process.
    """

    def __init__(self, simulation: Simulation, opened: Sequence[HeldDevice] = ()) -> None:
        self._simulation = simulation
        self._opened = opened
        self._entries: list[_Entry] = []

    @property
    def nodes(self) -> tuple[Node, ...]:
        """Return the running nodes in order of arrival."""
        return tuple(entry.node for entry in self._entries)

    def add(self, node: Node) -> None:
        """Start a node and step it from now on."""
        entry = _Entry(node, self._simulation.now_ns)
        self._run(entry, node.start)
        entry.due_ns = self._simulation.now_ns
        self._entries.append(entry)

    def remove(self, node: Node) -> None:
        """Stop a node in order.

        Raises:
            KeyError: the node does not run.
        """
        self._entries.remove(self._entry(node))
        node.stop()

    def kill(self, node: Node) -> None:
        """End a node as `kill -9` does: no `stop`, its open devices just close.

        Raises:
            KeyError: the node does not run.
        """
        entry = self._entry(node)
        self._entries.remove(entry)
        for device in entry.opened:
            device.close()

    def stop(self) -> None:
        """Stop every node, the latest first."""
        while self._entries:
            self._entries.pop().node.stop()

    def run_until(self, predicate: Callable[[], bool], deadline_ns: int) -> bool:
        """Run until `predicate()` or `deadline_ns`; return whether the predicate came true."""
        while not predicate():
            if self._simulation.now_ns >= deadline_ns:
                return False
            self._advance()
        return True

    def _advance(self) -> None:
        """Step the node that is due, or else the simulation once."""
        entry = min(self._entries, key=lambda each: each.due_ns, default=None)
        if entry is None or entry.due_ns > self._simulation.now_ns:
            self._simulation.step()
            return
        self._run(entry, entry.node.step)
        period_ns = round(entry.node.period_s * NS_PER_S)
        entry.due_ns = max(entry.due_ns + period_ns, self._simulation.now_ns)

    def _run(self, entry: _Entry, work: Callable[[], None]) -> None:
        before = len(self._opened)
        work()
        entry.opened.extend(self._opened[before:])

    def _entry(self, node: Node) -> _Entry:
        for entry in self._entries:
            if entry.node is node:
                return entry
        raise KeyError(f"{node!r} does not run")
