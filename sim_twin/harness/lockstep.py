"""Run the robot's nodes and its twin in one process on simulated time: same seed, same bits.

Nodes are stepped by due time, in a repeatable order.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final, Protocol

import can

from drivers.clock import NS_PER_S
from drivers.errors import DeviceMissing
from drivers.estop.gpio_button import Contact
from drivers.power_relay.base import LevelOutput
from drivers.power_relay.streamed_level import StreamedLevel
from sim_twin.can import MemoryBus
from sim_twin.device import WireDevice
from sim_twin.faults import FaultInjector
from sim_twin.ports.lines import MemoryLine
from sim_twin.servos import WireTiming
from sim_twin.timing.clock import SimClock, Simulation
from sim_twin.twin import Twin
from vla_deploy.robots import load_robot
from vla_deploy.runtime.node import Node, NodeContext

DEVICES_DIR: Final = "dev"
"""Where the twin's files are, below the run's directory."""


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

    def run_for(self, duration_s: float) -> None:
        """Run for a span of simulated time."""
        self.run_until(lambda: False, duration_s)

    def run_until(self, predicate: Callable[[], object], timeout_s: float) -> bool:
        """Run until `predicate()`; return False when `timeout_s` of simulated time passed first."""
        deadline_ns = self._simulation.now_ns + round(timeout_s * NS_PER_S)
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


class MemoryOpener:
    """Open the twin's devices in memory; implements `drivers.opener.DeviceOpener`."""

    def __init__(self, twin: Twin, clock: SimClock) -> None:
        self.opened: list[HeldDevice] = []
        self._twin = twin
        self._clock = clock

    def serial(self, name: str) -> MemoryLine:
        """Open a serial line.

        Raises:
            DeviceMissing: the robot file does not name it, or it is unplugged.
        """
        lines = self._twin.lines
        if name not in lines:
            raise DeviceMissing(f"the twin has no serial device {name!r}; it has {list(lines)}")
        return self._plugged(name, lines[name])

    def stream(self, name: str) -> MemoryLine:
        """Open the camera's stream, or that of sound.

        Raises:
            DeviceMissing: the robot file does not name it, or it is unplugged.
        """
        if name in self._twin.stream_lines:
            return self.input_events(name)
        self._expect(name, self._twin.robot.camera.device)
        return self._plugged(name, self._twin.camera_line)

    def video(self, name: str) -> MemoryLine:
        """Open the camera's stream in the place of a video device.

        Raises:
            DeviceMissing: the robot file does not name it, or it is unplugged.
        """
        return self.stream(name)

    def can(self, name: str) -> can.BusABC:
        """Open the CAN bus.

        Raises:
            DeviceMissing: the robot file does not name it.
        """
        self._expect(name, self._twin.robot.can_bus.device)
        bus = MemoryBus(self._twin.can_wire)
        self.opened.append(_Leaver(bus))
        return bus

    def input_events(self, name: str) -> MemoryLine:
        """Open a device that begins anew for each host, such as the e-stop button.

        Raises:
            DeviceMissing: the robot file does not name it, or it is unplugged.
        """
        lines = self._twin.stream_lines
        if name not in lines:
            raise DeviceMissing(f"the twin has no stream {name!r}; it has {list(lines)}")
        line = self._plugged(name, lines[name])
        self._twin.announce(name)
        return line

    def gpio_contact(self, name: str, offset: int) -> Contact:
        """Refuse: a GPIO line has no wire that the twin could serve.

        Raises:
            DeviceMissing: always.
        """
        raise DeviceMissing(
            f"{name}: the twin has no GPIO lines; declare the e-stop as HID to run it in the twin"
        )

    def gpio_output(self, name: str, offset: int) -> LevelOutput:
        """Open the line of the relay in the servos' supply.

        Raises:
            DeviceMissing: the robot file does not name it, or it is unplugged.
        """
        del offset
        return StreamedLevel(self.input_events(name))

    def _plugged(self, name: str, device: WireDevice) -> MemoryLine:
        plug = self._twin.plugs[name]
        if not plug.is_in:
            raise DeviceMissing(f"{name}: unplugged; plug it in")
        line = MemoryLine(device, self._clock)
        plug.add_connection(line)
        self.opened.append(line)
        return line

    def _expect(self, name: str, known: str) -> None:
        if name != known:
            raise DeviceMissing(f"the twin has no device {name!r} of this kind; it has {known!r}")


class _Leaver:
    """Give a CAN bus the `close` that the lines have."""

    def __init__(self, bus: can.BusABC) -> None:
        self._bus = bus

    def close(self) -> None:
        """Leave the bus; leaving twice is allowed."""
        self._bus.shutdown()


class Lockstep(Schedule):
    """Own a twin, its clock and the nodes that run against it.

    Build nodes with `context` (its run directory is `tmp_path`) and `devices`, then `add` them.
    """

    def __init__(
        self,
        robot: str = "butler",
        world: str = "",
        seed: int = 0,
        profile: str = "desktop",
        *,
        tmp_path: Path,
        servo_timing: WireTiming | None = None,
    ) -> None:
        """Build the robot in its world; without `servo_timing` the servo bus takes no time.

        Raises:
            RobotFileError: the robot file has faults.
            ModelMismatch: there is no such world, or robot and world do not fit together.
        """
        self.robot = load_robot(robot)
        self.twin = Twin(self.robot, world, seed, servo_timing)
        if self.twin.battery is not None:
            self.twin.battery.serve(tmp_path / DEVICES_DIR)
        self.clock = SimClock(self.twin)
        self.devices = MemoryOpener(self.twin, self.clock)
        self.context = NodeContext(
            run_dir=tmp_path, robot=robot, profile=profile, devices_dir=None, clock=self.clock
        )
        super().__init__(self.twin, self.devices.opened)

    @property
    def now_s(self) -> float:
        """Return simulated time in seconds."""
        return self.twin.now_ns / NS_PER_S

    @property
    def faults(self) -> FaultInjector:
        """Return what makes the twin's devices fail."""
        return self.twin.faults

    def truth(self) -> dict[str, Any]:
        """Return what the physics knows; see `sim_twin.physics.truth.Referee`."""
        return self.twin.truth()

    def inside(self, name: str, container: str) -> dict[str, Any]:
        """Return whether an object rests in a container.

        Raises:
            RefereeRefusal: the world has no such object or container.
        """
        return self.twin.engine.referee.inside(name, container)

    def close(self) -> None:
        """Stop every node, the latest first, and release the twin."""
        self.stop()
        self.twin.close()
