"""Run the twin for other processes: physics step by step, buses answered between any two steps."""

import gc
import json
import os
import select
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, Final

from drivers.clock import Clock
from drivers.twin_clock import TwinClock
from drivers.twin_page import PAGE_FILE, TwinPace
from sim_twin.can import CanHub
from sim_twin.errors import RefereeRefusal, TwinError
from sim_twin.faults.camera_relay import faults_in_force
from sim_twin.faults.fault_server import FaultServer
from sim_twin.faults.plug import Carrier
from sim_twin.physics.engine import STEP_NS
from sim_twin.pictures.drawing import start_camera, start_viewer
from sim_twin.pictures.mirror import MirrorState
from sim_twin.pictures.mirror_link import MirrorLink
from sim_twin.ports.json_line_server import JsonLineServer
from sim_twin.ports.pty_line import PtyLine
from sim_twin.ports.stream_line import StreamLine
from sim_twin.priority import Priority, claim_priority
from sim_twin.referee import REFEREE_SOCKET
from sim_twin.servos import WireTiming
from sim_twin.sound.sound_server import SoundServer
from sim_twin.timing.governor import Governor
from sim_twin.timing.pacer import Pacer, RealTimeFactor
from sim_twin.timing.wall_time import WallTime
from sim_twin.twin import Twin
from sim_twin.twin_status import TwinStatus
from sim_twin.wire_digest import WireDigest
from vla_deploy.robots import RobotDescription, load_robot
from vla_deploy.robots.home_devices import BROKER_SOCKET

_UNUSED_CAN_BUS: Final = "can"
"""Where the hub of a robot without drives is: nothing is on it."""
READY_FILE = "ready"
MOST_PATH_BYTES = 90
"""A Unix socket's path holds 107 bytes; the device's name needs the rest."""


@dataclass(frozen=True, slots=True, kw_only=True)
class TwinOptions:
    """Say which robot lives in which world, and where its devices are served.

    `paced` gives bytes on the servo bus and frames on the CAN bus the time they take on the wire;
    `pace` says how time goes, which waits for the process `hold_for_pid` before it begins.
    """

    robot: str
    world: str
    seed: int
    run_dir: Path
    camera: bool = True
    viewer: bool = False
    paced: bool = False
    pace: TwinPace = TwinPace.WALL
    hold_for_pid: int | None = None

    @property
    def devices_dir(self) -> Path:
        """Return the folder of the device files."""
        return self.run_dir / "dev"


class TwinProcess:
    """Serve one twin's devices under `<run_dir>/dev` from a single-threaded loop."""

    def __init__(self, options: TwinOptions, clock: Clock) -> None:
        """Serve every device; the file `ready` appears last. `clock` is the wall's.

        Raises:
            TwinError: the model does not load, the camera cannot render, or there is no display
                for a viewer.
            DeviceBusy: another twin serves the same folder.
        """
        devices = _short_enough(options.devices_dir)
        devices.mkdir(parents=True, exist_ok=True)
        self._ready = devices / READY_FILE
        self._ready.unlink(missing_ok=True)
        robot = load_robot(options.robot)
        self._twin = _build_twin(options, robot)
        if self._twin.battery is not None:
            self._twin.battery.serve(devices)
        self._digest = WireDigest(lambda: self._now_ns())
        can_bus = robot.parts.can_bus.device if robot.parts.can_bus else _UNUSED_CAN_BUS
        self._hub = CanHub(self._twin.can_wire, devices / can_bus, on_packet=self._digest.add)
        self._twin.begin_home(devices / BROKER_SOCKET)
        self._drawings = _start_drawings(options, robot)
        self._servo_line = self._open_servo_line(devices / robot.servo_bus.device)
        self._lines = {robot.servo_bus.device: self._servo_line} | {
            name: PtyLine(line, devices / name)
            for name, line in self._twin.lines.items()
            if name != robot.servo_bus.device
        }
        self._streams = {
            name: StreamLine(line, devices / name, partial(self._twin.announce, name))
            for name, line in self._twin.stream_lines.items()
        }
        served: dict[str, Carrier] = {**self._lines, **self._streams}
        for name, carrier in served.items():
            self._twin.plugs[name].add_socket(carrier)
        self._referee = JsonLineServer(devices / REFEREE_SOCKET, self.answer)
        self._operations: Mapping[str, Callable[[Mapping[str, Any]], dict[str, Any]]] = {
            "truth": self._truth,
            "inside": self._inside,
            "hazards": self._hazards,
            "things": self._things,
            "take": self._take,
            "put": self._put,
            "walk": self._walk,
            **FaultServer(self._twin.faults, robot).operations,
            **SoundServer(self._twin, devices, options.seed, self._clock_ns).operations,
        }
        gc.collect()
        gc.freeze()  # a full collection of the model and libraries takes longer than a step
        self._held_by = ""
        self._wall = clock
        self._time = self._begin_time(options)
        self._base_ns = self._time.now_ns - self._twin.now_ns
        self._factor = RealTimeFactor(clock.now_ns(), self._twin.now_ns)
        self._status = TwinStatus(options.run_dir, self._clock(options), options.pace)
        self._ready.write_text(json.dumps({"pid": os.getpid()}), encoding="utf-8")

    def run(self, should_stop: Callable[[], bool]) -> None:
        """Step and serve until `should_stop()`."""
        wait_s = 0.0
        while not should_stop():
            ready, _, _ = select.select(self._filenos(), [], [], wait_s)
            self._base_ns += self._time.go_round()
            if ready:
                self._serve(set(ready))
                wait_s = 0.0
            else:
                # Nothing is under way any more: what everybody has done up to now is known.
                wait_s = self._go_on()

    def close(self) -> None:
        """Take every device away."""
        self._ready.unlink(missing_ok=True)
        self._time.close()
        self._status.close()
        self._referee.close()
        self._hub.close()
        self._twin.leave_home()
        if self._twin.battery is not None:
            self._twin.battery.withdraw()
        for line in self._lines.values():
            line.close()
        for stream in self._streams.values():
            stream.close()
        for drawing in self._drawings:
            drawing.close()

    def answer(self, request: Mapping[str, Any]) -> dict[str, Any]:
        """Answer the referee, the person in the world, and what the fault desk is asked.

        Raises:
            RefereeRefusal: the operation, object or container is unknown.
            FaultRefused: the fault is unknown, not supported there, or out of range.
        """
        operation = self._operations.get(str(request.get("op")))
        if operation is None:
            known = ", ".join(self._operations)
            raise RefereeRefusal(f"no operation {request.get('op')!r}; there are {known}")
        return operation(request)

    def _open_servo_line(self, path: Path) -> PtyLine:
        """Serve the servo bus, whose bytes may take their time, at the speed that the host sets."""
        twin = self._twin
        line, on_baud = twin.lines[path.name], twin.servos.set_host_baud
        return PtyLine(line, path, now_ns=self._now_ns, on_baud=on_baud, on_bytes=self._digest.add)

    def _begin_time(self, options: TwinOptions) -> Governor | WallTime:
        # As fast as it can, it would leave the robot's page and whoever watches no core.
        self._priority = Priority.ORDINARY if options.pace is TwinPace.FAST else claim_priority()
        if options.pace is TwinPace.WALL:
            (options.devices_dir / PAGE_FILE).unlink(missing_ok=True)  # of a twin before this one
            return WallTime(self._wall)
        pacer = Pacer(self._wall, is_fast=options.pace is TwinPace.FAST)
        return Governor(options.devices_dir, pacer, options.hold_for_pid)

    def _clock(self, options: TwinOptions) -> Clock:
        if options.pace is TwinPace.WALL:
            return self._wall
        return TwinClock(options.devices_dir)

    def _go_on(self) -> float:
        """Wake a member, or move time to what is due next; return how long to wait for others."""
        self._deliver()
        step_ns = self._twin.now_ns + STEP_NS + self._base_ns
        wait_s = self._time.go_on(min((step_ns, *self._arrivals_ns())))
        if wait_s is not None:
            return wait_s
        if self._time.now_ns >= step_ns:
            self._step()
        return 0.0

    def _arrivals_ns(self) -> Iterator[int]:
        """Return when something arrives at a host between two steps."""
        wire = self._twin.can_wire
        arrivals = self._twin.servos.next_due_ns(), wire.next_due_ns() if wire.timed else None
        return (due_ns + self._base_ns for due_ns in arrivals if due_ns is not None)

    def _now_ns(self) -> int:
        """Return simulated time, which passes between two steps too."""
        return min(self._time.now_ns - self._base_ns, self._twin.now_ns + STEP_NS)

    def _clock_ns(self, sim_ns: int) -> int:
        """Return the time on the run's clock at a simulated time."""
        return sim_ns + self._base_ns

    def _deliver(self) -> None:
        """Hand over what has arrived between two steps."""
        reply_ns = self._twin.servos.next_due_ns()
        if reply_ns is not None and reply_ns <= self._now_ns() and self._servo_line.is_plugged:
            self._servo_line.poll_once()
            self._time.note_writes()
        if self._twin.can_wire.timed:
            self._twin.can_wire.poll(self._now_ns())

    def _hear_frames(self) -> None:
        """Take what hosts have sent on CAN, as sent now."""
        self._twin.can_wire.poll(self._now_ns())
        self._hub.carry_once()

    def _step(self) -> None:
        # What waits was sent before now: were it heard after the step, heartbeats would be missed.
        self._hear_frames()
        self._twin.step()
        for line in self._plugged():
            line.send_once()
        for stream in self._streams.values():
            stream.send_once()
        now_ns = self._twin.now_ns
        self._time.note_writes()
        self._tell_status(now_ns)
        state = MirrorState(
            now_ns=now_ns,
            clock_ns=self._clock_ns(now_ns),
            qpos=self._twin.engine.data.qpos,
            switched_on=self._twin.switched_on,
            camera_faults=faults_in_force(self._twin.faults),
        )
        for drawing in self._drawings:
            drawing.show(state)

    def _tell_status(self, now_ns: int) -> None:
        """Publish how fast time goes, and who has held it most."""
        if self._factor.update(self._wall.now_ns(), now_ns):
            blamed = self._time.blamed_ns
            self._held_by = max(blamed, key=lambda name: blamed[name], default="")
            blamed.clear()
        self._status.publish(self._clock_ns(now_ns), now_ns, self._factor.value, self._held_by)

    def _plugged(self) -> list[PtyLine]:
        return [line for line in self._lines.values() if line.is_plugged]

    def _filenos(self) -> list[int]:
        lines = [line.fileno() for line in self._plugged()]
        streams = [fileno for stream in self._streams.values() for fileno in stream.filenos()]
        devices = [*lines, *streams, *self._hub.filenos()]
        # A member that works gets no answer before it waits: else what it reads without waiting
        # would depend on how soon this process runs.
        return [*self._askers(), *(() if self._time.is_held else devices)]

    def _askers(self) -> list[int]:
        return [*self._time.filenos(), *self._referee.filenos()]

    def _serve(self, ready: set[int]) -> None:
        is_device = not ready.issubset(self._askers())  # before one of them may leave
        self._time.serve(ready)
        if not ready.isdisjoint(self._referee.filenos()):
            self._referee.poll_once()
        if not is_device:
            return
        for line in self._plugged():
            if line.fileno() in ready:
                line.poll_once()
        for stream in self._streams.values():
            if not ready.isdisjoint(stream.filenos()):
                stream.poll_once()
        if not ready.isdisjoint(self._hub.filenos()):
            self._twin.can_wire.poll(self._now_ns())
            self._hub.poll_once()
        self._time.note_writes()

    def _truth(self, _request: Mapping[str, Any]) -> dict[str, Any]:
        return {
            **self._twin.truth(),
            "real_time_factor": self._factor.value,
            "priority": self._priority.value,
            "wire_digest": self._digest.text(),
        }

    def _hazards(self, request: Mapping[str, Any]) -> dict[str, Any]:
        """Return the hazards since the last time that somebody wanted to `begin`."""
        watch = self._twin.hazards
        found = {"hazards": watch.document()}
        if request.get("begin"):
            watch.begin()
        return found

    def _things(self, _request: Mapping[str, Any]) -> dict[str, Any]:
        return self._twin.person.document()

    def _take(self, request: Mapping[str, Any]) -> dict[str, Any]:
        self._twin.person.take(str(request.get("object")))
        return self._twin.person.document()

    def _put(self, request: Mapping[str, Any]) -> dict[str, Any]:
        self._twin.person.put(str(request.get("object")), request)
        return self._twin.person.document()

    def _walk(self, request: Mapping[str, Any]) -> dict[str, Any]:
        self._twin.person.walk(request.get("way_m"), request.get("speed_m_s"))
        return self._twin.person.document()

    def _inside(self, request: Mapping[str, Any]) -> dict[str, Any]:
        names = str(request.get("object")), str(request.get("container"))
        return self._twin.engine.referee.inside(*names)


def _build_twin(options: TwinOptions, robot: RobotDescription) -> Twin:
    timing = WireTiming(baud=robot.servo_bus.baud) if options.paced else None
    twin = Twin(robot, options.world, options.seed, timing)
    twin.can_wire.timed = options.paced
    return twin


def _start_drawings(options: TwinOptions, robot: RobotDescription) -> list[MirrorLink]:
    drawings: list[MirrorLink] = []
    try:
        if options.viewer:
            drawings.append(start_viewer(options.robot, options.world))
        if options.camera and robot.parts.camera is not None:
            devices_dir = options.devices_dir
            drawings.append(
                start_camera(
                    options.robot,
                    options.world,
                    options.seed,
                    devices_dir,
                    is_member=options.pace is not TwinPace.WALL,
                )
            )
    except BaseException:
        for drawing in drawings:
            drawing.close()
        raise
    return drawings


def _short_enough(devices_dir: Path) -> Path:
    length = len(os.fsencode(devices_dir))
    if length > MOST_PATH_BYTES:
        raise TwinError(
            f"{devices_dir}: a path to sockets may have {MOST_PATH_BYTES} bytes, this one has "
            f"{length}; choose a shorter one, for a run with vla-deploy --runtime-base DIR"
        )
    return devices_dir
