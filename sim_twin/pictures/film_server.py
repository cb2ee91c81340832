"""Start, caption and stop the film on request, and shoot when a frame is due."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import mujoco

from drivers.clock import NS_PER_S
from sim_twin.errors import RefereeRefusal
from sim_twin.pictures.film import FPS, Film

_Text = Mapping[str, Any]


class FilmServer:
    """Own at most one film of a model's state; `camera` is the robot's own, for the inset."""

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData, *, camera: str) -> None:
        self._model = model
        self._data = data
        self._camera = camera
        self._film: Film | None = None
        self._due_ns = 0
        self._operations: dict[str, Callable[[_Text], dict[str, Any]]] = {
            "film_start": self._start,
            "film_stop": self._stop,
            "caption": self._caption,
        }

    def answer(self, request: Mapping[str, Any]) -> dict[str, Any]:
        """Carry out `film_start`, `film_stop` or `caption`.

        Raises:
            RefereeRefusal: the operation is unknown, or no film runs (or one runs already).
            FilmFault: the file cannot be written.
        """
        operation = self._operations.get(str(request.get("op")))
        if operation is None:
            known = ", ".join(self._operations)
            raise RefereeRefusal(f"no operation {request.get('op')!r}; there are {known}")
        return operation(request)

    def is_due(self, now_ns: int) -> bool:
        """Return whether a frame is due in simulated time."""
        return self._film is not None and now_ns >= self._due_ns

    def shoot(self, now_ns: int) -> None:
        """Add a frame."""
        self._due_ns = max(self._due_ns + round(NS_PER_S / FPS), now_ns)
        self._running().shoot()

    def close(self) -> None:
        """Finish a film that still runs."""
        if self._film is not None:
            self._stop({})

    def _start(self, request: _Text) -> dict[str, Any]:
        if self._film is not None:
            raise RefereeRefusal(f"a film to {self._film.path} runs already; stop it first")
        path = request.get("path")
        if not isinstance(path, str) or not path:
            raise RefereeRefusal(f"film_start: expected a path, got {path!r}")
        self._film = Film(self._model, self._data, Path(path), camera=self._camera)
        return {"film": path}

    def _stop(self, _request: _Text) -> dict[str, Any]:
        film, self._film = self._running(), None
        film.close()
        return {"film": str(film.path), "sheet": str(film.sheet_path), "frames": film.frames}

    def _caption(self, request: _Text) -> dict[str, Any]:
        self._running().caption = str(request.get("text", ""))
        return {}

    def _running(self) -> Film:
        if self._film is None:
            raise RefereeRefusal("no film runs; start one with film_start")
        return self._film
