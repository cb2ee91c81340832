"""Record what a robot in lock-step did, for people who ask why a case failed."""

import tempfile
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

import cv2
import numpy as np

from sim_twin.errors import FilmFault, OpenGLMissing
from sim_twin.harness.lockstep_stack import LockstepControl
from sim_twin.pictures.film import Film
from sim_twin.worlds.draw_map import footprints_m
from vla_deploy.cli.operation.say import line_of
from vla_deploy.ipc import topics

Watch = Callable[[LockstepControl], None]
"""What is done with a robot before its case begins."""
Point = tuple[float, float]
_THERE_M: Final = 50.0
"""What somebody brings is farther away while it is not there."""
_PICTURE_EVERY_S: Final = 2.0
_LEAST_WAY_M: Final = 0.03
_JPEG_QUALITY: Final = 70


def unwatched(_stack: LockstepControl) -> None:
    """Record nothing."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SceneEvidence:
    """Hold where the base was, what stands there (map frame), what was told, and pictures.

    `others_m` are the places of chair and person, which are put into the way. `pushes` is how many
    pairs of parts the physics saw pushing too hard (`HazardWatch`).
    """

    path_m: tuple[Point, ...] = ()
    others_m: tuple[Point, ...] = ()
    outlines_m: tuple[tuple[Point, ...], ...] = ()
    log: tuple[str, ...] = ()
    pictures_jpeg: bytes = b""
    pushes: int | None = None

    def without_pictures(self) -> "SceneEvidence":
        """Return it as it is kept of what passed."""
        return replace(self, pictures_jpeg=b"")


class SceneRecorder:
    """Run beside the robot's nodes and look on; `evidence` is whole once the robot is closed."""

    period_s = 0.1

    def __init__(self, stack: LockstepControl) -> None:
        self._stack = stack
        self._events = stack.space.ring_reader(topics.TASK_EVENT, from_start=True)
        self._path_m: list[Point] = []
        self._others_m: dict[Point, None] = {}
        self._log: list[str] = []
        self._control = ""
        self._film: Film | None = None
        self._folder = tempfile.TemporaryDirectory(prefix="vla-scene-")
        self._next_picture_s = 0.0
        self._pictures = b""
        self._hazards = stack.lockstep.twin.hazards

    def start(self) -> None:
        """Begin to film, where pictures can be drawn."""
        engine = self._stack.lockstep.twin.engine
        path, camera = Path(self._folder.name) / "scene.avi", self._stack.robot.camera.site
        try:
            self._film = Film(engine.model, engine.data, path, camera=camera)
        except (OpenGLMissing, FilmFault) as error:
            self._note(f"no pictures: {error}")

    def step(self) -> None:
        """Note where the base is, what is new, and take a picture now and then."""
        self._follow_base()
        self._follow_others()
        self._follow_control()
        for event in self._events.drain():
            if line := line_of(event.payload):
                self._note(line)
        if self._film is not None and self._stack.lockstep.now_s >= self._next_picture_s:
            self._next_picture_s = self._stack.lockstep.now_s + _PICTURE_EVERY_S
            self._film.caption = f"{self._stack.lockstep.now_s:.0f} s  {self._control}"
            self._film.shoot()

    def stop(self) -> None:
        """Finish the pictures."""
        self.step()
        if self._film is not None:
            self._film.close()
            self._pictures = _as_jpeg(self._film.sheet_path)
        self._folder.cleanup()

    @property
    def evidence(self) -> SceneEvidence:
        """Return what was seen."""
        engine = self._stack.lockstep.twin.engine
        return SceneEvidence(
            path_m=tuple(self._path_m),
            others_m=tuple(self._others_m),
            outlines_m=tuple(footprints_m(engine.model, engine.data)),
            log=tuple(self._log),
            pictures_jpeg=self._pictures,
            pushes=sum(hazard.kind == "push" for hazard in self._hazards.found),
        )

    def _follow_base(self) -> None:
        robot = self._stack.lockstep.truth()["robot"]
        at_m = round(robot["x_m"], 3), round(robot["y_m"], 3)
        if not self._path_m or np.hypot(*np.subtract(at_m, self._path_m[-1])) > _LEAST_WAY_M:
            self._path_m.append(at_m)

    def _follow_others(self) -> None:
        for x_m, y_m, _ in self._stack.lockstep.twin.engine.data.mocap_pos.tolist():
            if max(abs(x_m), abs(y_m)) < _THERE_M:
                self._others_m[round(x_m, 1), round(y_m, 1)] = None

    def _follow_control(self) -> None:
        status = self._stack.status()
        now = " ".join(str(status.get(key, "")) for key in ("state", "cause")).strip()
        if now != self._control:
            self._control = now
            self._note(f"control: {now}")

    def _note(self, line: str) -> None:
        self._log.append(f"{self._stack.lockstep.now_s:7.1f} s  {line}")


class SceneWatch:
    """Be a `Watch` that records every robot of a case."""

    def __init__(self) -> None:
        self._recorders: list[SceneRecorder] = []

    def __call__(self, stack: LockstepControl) -> None:
        """Record this robot from now on."""
        recorder = SceneRecorder(stack)
        self._recorders.append(recorder)
        stack.lockstep.add(recorder)

    @property
    def evidence(self) -> tuple[SceneEvidence, ...]:
        """Return what was seen of each robot; they must be closed."""
        return tuple(recorder.evidence for recorder in self._recorders)


def _as_jpeg(picture: Path) -> bytes:
    """Return a picture in a tenth of its bytes; none where there is none."""
    if not picture.exists():
        return b""
    image = cv2.imread(str(picture))
    encoded = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, _JPEG_QUALITY])[1]
    return encoded.tobytes()
