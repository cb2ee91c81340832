"""Film the robot at work: a chasing camera, the robot's own camera inset, and a contact sheet."""

from pathlib import Path

import cv2
import mujoco
import numpy as np
from numpy.typing import NDArray

from sim_twin.errors import FilmFault
from sim_twin.pictures.chase_camera import ChaseCamera
from sim_twin.pictures.renderer import Renderer, fixed_camera

Image = NDArray[np.uint8]

WIDTH, HEIGHT = 640, 360
INSET_WIDTH, INSET_HEIGHT = 160, 120
FPS = 5.0
SHEET_ROWS, SHEET_COLUMNS = 4, 3
FOURCC = {".webm": "VP80", ".mp4": "mp4v", ".avi": "MJPG"}
_MARGIN = 10
_INK = (250, 250, 250)
_SHADE = 0.45


class Film:
    """Write frames to a video file and, at the end, a contact sheet beside it."""

    def __init__(
        self,
        model: mujoco.MjModel,
        data: mujoco.MjData,
        path: Path,
        *,
        camera: str,
        fps: float = FPS,
    ) -> None:
        """Open the file; its ending chooses the codec. `camera` is the robot's own, for the inset.

        Raises:
            ModelMismatch: the model has no such camera.
            FilmFault: the ending is unknown, or the file cannot be written.
            OpenGLMissing: nothing can be rendered here.
        """
        self.path = path
        self.sheet_path = path.with_suffix(".png")
        self.caption = ""
        self.frames = 0
        self._data = data
        self._own = fixed_camera(model, camera)
        self._writer = _open_writer(path, fps)
        self._chase = ChaseCamera(model, data)
        self._renderer = Renderer(model, WIDTH, HEIGHT)
        self._inset_renderer = Renderer(model, INSET_WIDTH, INSET_HEIGHT)
        self._kept: list[Image] = []
        self._keep_every = 1

    def shoot(self) -> Image:
        """Add one frame of the present state; return it (RGB)."""
        image = self._renderer.render(self._data, self._chase.follow())[0]
        self._paste_inset(image, self._inset_renderer.render(self._data, self._own)[0])
        _write_caption(image, self.caption)
        self._writer.write(cv2.cvtColor(image, cv2.COLOR_RGB2BGR))
        self._keep(image)
        self.frames += 1
        return image

    def close(self) -> None:
        """Finish the video and write the contact sheet."""
        self._writer.release()
        self._renderer.close()
        self._inset_renderer.close()
        if self._kept:
            sheet = contact_sheet(self._kept)
            cv2.imwrite(str(self.sheet_path), cv2.cvtColor(sheet, cv2.COLOR_RGB2BGR))

    def _paste_inset(self, image: Image, inset: Image) -> None:
        top, left = _MARGIN, WIDTH - INSET_WIDTH - _MARGIN
        image[top - 2 : top + INSET_HEIGHT + 2, left - 2 : left + INSET_WIDTH + 2] = _INK
        image[top : top + INSET_HEIGHT, left : left + INSET_WIDTH] = inset

    def _keep(self, image: Image) -> None:
        """Keep an evenly spread sample: drop every second frame whenever it has grown too big."""
        if self.frames % self._keep_every == 0:
            self._kept.append(image)
        if len(self._kept) >= 4 * SHEET_ROWS * SHEET_COLUMNS:
            self._kept = self._kept[::2]
            self._keep_every *= 2


def contact_sheet(frames: list[Image]) -> Image:
    """Return up to 12 frames, spread evenly in time, as one picture of half-size tiles."""
    count = SHEET_ROWS * SHEET_COLUMNS
    chosen = np.linspace(0, len(frames) - 1, count).round().astype(int)
    tiles = [
        cv2.resize(frames[i], None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA) for i in chosen
    ]
    rows = [
        np.hstack(tiles[row * SHEET_COLUMNS : (row + 1) * SHEET_COLUMNS])
        for row in range(SHEET_ROWS)
    ]
    return np.vstack(rows)


def _open_writer(path: Path, fps: float) -> cv2.VideoWriter:
    code = FOURCC.get(path.suffix)
    if code is None:
        raise FilmFault(f"{path}: expected an ending of {', '.join(FOURCC)}, got {path.suffix!r}")
    path.parent.mkdir(parents=True, exist_ok=True)
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*code), fps, (WIDTH, HEIGHT))
    if not writer.isOpened():
        raise FilmFault(f"{path}: cannot write a {code} video; try another ending or folder")
    return writer


def _write_caption(image: Image, text: str) -> None:
    if not text:
        return
    strip = image[HEIGHT - 34 :]
    strip[:] = (strip * _SHADE).astype(np.uint8)
    place = (_MARGIN, HEIGHT - 12)
    cv2.putText(image, text, place, cv2.FONT_HERSHEY_SIMPLEX, 0.55, _INK, 1, cv2.LINE_AA)
