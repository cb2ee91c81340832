"""Run the twin on the wall clock: physics paced, buses answered between any two steps."""

import gc
import json
import os
import select
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from drivers.clock import NS_PER_S, Clock
from sim_twin.can import CanHub
from sim_twin.drawing import start_camera, start_viewer
from sim_twin.engine import STEP_NS
from sim_twin.errors import RefereeRefusal, TwinError
from sim_twin.faults.camera_relay import faults_in_force
from sim_twin.faults.desk import FaultDesk
from sim_twin.faults.plug import Carrier
from sim_twin.json_line_server import JsonLineServer
from sim_twin.mirror import MirrorState
from sim_twin.mirror_link import MirrorLink
from sim_twin.pacer import Pacer, RealTimeFactor
from sim_twin.priority import claim_priority
from sim_twin.pty_line import PtyLine
from sim_twin.referee import REFEREE_SOCKET
from sim_twin.servos import WireTiming
from sim_twin.sound.desk import SoundDesk
from sim_twin.stream_line import StreamLine
from sim_twin.twin import Twin
from sim_twin.twin_status import TwinStatus
from vla_deploy.robots import load_robot

READY_FILE = "ready"
MOST_PATH_BYTES = 90
"""A Unix socket's path holds 107 bytes; the device's name needs the rest."""


@dataclass(frozen=True, slots=True, kw_only=True)
class TwinOptions:
    """Say which robot lives in which world, and where its devices are served.

    `paced` gives bytes on the servo bus and frames on the CAN bus the time they take on the wire.
    """

    robot: str
    world: str
    seed: int
    run_dir: Path
    camera: bool = True
    viewer: bool = False
    paced: bool = False

    @property
    def devices_dir(self) -> Path:
        """Return the folder of the device files."""
        return self.run_dir / "dev"


class TwinProcess:
    """Serve one twin's devices under `<run_dir>/dev` from a single-threaded loop."""

    def __init__(self, options: TwinOptions, clock: Clock) -> None:
        """Serve every device; the file `ready` appears last.

        Raises:
            TwinError: the model does not load, the camera cannot render, or there is no display
                for a viewer.
            DeviceBusy: another twin serves the same folder.
        """
        devices = _short_enough(options.devices_dir)
        devices.mkdir(parents=True, exist_ok=True)
        self._ready = devices / READY_FILE
        self._ready.unlink(missing_ok=True)
        self._clock = clock
        robot = load_robot(options.robot)
        timing = WireTiming(baud=robot.servo_bus.baud) if options.paced else None
        self._twin = Twin(robot, options.world, options.seed, timing)
        self._twin.can_wire.timed = options.paced
        self._hub = CanHub(self._twin.can_wire, devices / robot.can_bus.device)
        self._drawings = _start_drawings(options)
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
            **FaultDesk(self._twin.faults, robot).operations,
            **SoundDesk(self._twin, devices, options.seed, self._wall_ns).operations,
        }
        gc.collect()
        gc.freeze()  # a full collection of the model and libraries takes longer than a step
        now_ns = clock.now_ns()
        self._priority = claim_priority()
        self._pacer = Pacer(STEP_NS, now_ns)
        self._factor = RealTimeFactor(now_ns, self._twin.now_ns)
        self._status = TwinStatus(options.run_dir, clock)
        self._ready.write_text(json.dumps({"pid": os.getpid()}), encoding="utf-8")

    def run(self, should_stop: Callable[[], bool]) -> None:
        """Step and serve until `should_stop()`."""
        while not should_stop():
            wall_ns = self._clock.now_ns()
            if self._pacer.due(wall_ns):
                self._step(wall_ns)
            ready, _, _ = select.select(self._filenos(), [], [], self._wait_ns() / NS_PER_S)
            if ready:
                self._serve(set(ready))
            self._deliver()

    def close(self) -> None:
        """Take every device away."""
        self._ready.unlink(missing_ok=True)
        self._status.close()
        self._referee.close()
        self._hub.close()
        for line in self._lines.values():
            line.close()
        for stream in self._streams.values():
            stream.close()
        for drawing in self._drawings:
            drawing.close()

    def answer(self, request: Mapping[str, Any]) -> dict[str, Any]:
        """Answer the referee's `truth` and `inside`, and what the fault desk is asked.

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
        return PtyLine(line, path, now_ns=self._now_ns, on_baud=on_baud)

    def _now_ns(self) -> int:
        """Return simulated time, which passes between two steps too."""
        return self._twin.now_ns + self._pacer.since_step_ns(self._clock.now_ns())

    def _wall_ns(self, sim_ns: int) -> int:
        """Return the host's time of a simulated one, as time passes now."""
        return self._clock.now_ns() + sim_ns - self._now_ns()

    def _wait_ns(self) -> int:
        """Return how long nothing is due: no step, and nothing under way to a host."""
        wait_ns = self._pacer.wait_ns(self._clock.now_ns())
        wire = self._twin.can_wire
        due = self._twin.servos.next_due_ns(), wire.next_due_ns() if wire.timed else None
        arrivals = [due_ns for due_ns in due if due_ns is not None]
        if not arrivals:
            return wait_ns
        return min(wait_ns, max(0, min(arrivals) - self._now_ns()))

    def _deliver(self) -> None:
        """Hand over what has arrived between two steps."""
        reply_ns = self._twin.servos.next_due_ns()
        if reply_ns is not None and reply_ns <= self._now_ns() and self._servo_line.is_plugged:
            self._servo_line.poll_once()
        if self._twin.can_wire.timed:
            self._twin.can_wire.poll(self._now_ns())

    def _hear_frames(self) -> None:
        """Take what hosts have sent on CAN, as sent now."""
        self._twin.can_wire.poll(self._now_ns())
        self._hub.carry_once()

    def _step(self, wall_ns: int) -> None:
        # What waits was sent before now: were it heard after the step, heartbeats would be missed.
        self._hear_frames()
        self._twin.slipped_ns = self._pacer.slipped_ns
        self._twin.step()
        self._pacer.stepped()
        for line in self._plugged():
            line.send_once()
        for stream in self._streams.values():
            stream.send_once()
        now_ns = self._twin.now_ns
        self._factor.update(wall_ns, now_ns)
        self._status.tell(wall_ns, now_ns, self._factor.value)
        state = MirrorState(
            now_ns=now_ns,
            wall_ns=wall_ns,
            qpos=self._twin.engine.data.qpos,
            camera_faults=faults_in_force(self._twin.faults),
        )
        for drawing in self._drawings:
            drawing.show(state)
        self._pacer.rest(wall_ns, self._clock.now_ns())

    def _plugged(self) -> list[PtyLine]:
        return [line for line in self._lines.values() if line.is_plugged]

    def _filenos(self) -> list[int]:
        lines = [line.fileno() for line in self._plugged()]
        streams = [fileno for stream in self._streams.values() for fileno in stream.filenos()]
        return [*lines, *streams, *self._hub.filenos(), *self._referee.filenos()]

    def _serve(self, ready: set[int]) -> None:
        for line in self._plugged():
            if line.fileno() in ready:
                line.poll_once()
        for stream in self._streams.values():
            if not ready.isdisjoint(stream.filenos()):
                stream.poll_once()
        if not ready.isdisjoint(self._hub.filenos()):
            self._twin.can_wire.poll(self._now_ns())
            self._hub.poll_once()
        if not ready.isdisjoint(self._referee.filenos()):
            self._referee.poll_once()

    def _truth(self, _request: Mapping[str, Any]) -> dict[str, Any]:
        return {
            **self._twin.engine.referee.truth(),
            "real_time_factor": self._factor.value,
            "slipped_s": self._pacer.slipped_ns / NS_PER_S,
            "priority": self._priority.value,
        }

    def _hazards(self, request: Mapping[str, Any]) -> dict[str, Any]:
        """Tell the hazards since the last time that somebody wanted to `begin`.

        `held_up_s` is for how long the computer let the devices stand still meanwhile.
        """
        watch = self._twin.hazards
        found = {"hazards": watch.document(), "held_up_s": self._pacer.worst_lag_ns / NS_PER_S}
        if request.get("begin"):
            watch.begin()
            self._pacer.worst_lag_ns = 0
        return found

    def _inside(self, request: Mapping[str, Any]) -> dict[str, Any]:
        names = str(request.get("object")), str(request.get("container"))
        return self._twin.engine.referee.inside(*names)


def _start_drawings(options: TwinOptions) -> list[MirrorLink]:
    drawings: list[MirrorLink] = []
    try:
        if options.viewer:
            drawings.append(start_viewer(options.robot, options.world))
        if options.camera:
            devices_dir = options.devices_dir
            drawings.append(start_camera(options.robot, options.world, options.seed, devices_dir))
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
