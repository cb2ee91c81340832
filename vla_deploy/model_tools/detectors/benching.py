"""Measure a model's files in turn, one run of each, so that load on the computer hits all alike."""

import dataclasses
import json
import subprocess
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from drivers.clock import NS_PER_S, Clock, MonotonicClock
from platforms import ModelChoice
from vla_deploy.inference.errors import RunFailed
from vla_deploy.inference.manifest import Variant
from vla_deploy.inference.manifest_file import read_manifest
from vla_deploy.inference.roles import ModelShelf
from vla_deploy.inference.session import ModelSession, open_session
from vla_deploy.inference.store import StoredModel
from vla_deploy.perception.detectors.detector import Detector
from vla_deploy.perception.detectors.image_input import Image

_PRECISIONS: Final = ("fp32", "fp16", "int8")
_INT8: Final = (Variant.INT8_U8S8, Variant.INT8_S8S8)


@dataclass(frozen=True, slots=True, kw_only=True)
class FileFigures:
    """Hold the figures of one file: frames, from the image to its boxes, and the runs in them.

    95 % of them take no longer than `_p95_s`. `memory_mb` is what a fresh process grows by.
    """

    variant: Variant
    provider: str
    frames: int
    frame_median_s: float
    frame_p95_s: float
    run_median_s: float
    run_p95_s: float
    load_s: float
    memory_mb: float
    notices: tuple[str, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class ModelFigures:
    """Hold the figures of one model.

    `int8_speedup` is by how much int8 runs faster than fp32; None unless both were measured.
    """

    model: str
    threads: int
    rows: tuple[FileFigures, ...]
    int8_speedup: float | None

    def document(self) -> dict[str, Any]:
        """Return the figures, as JSON takes them."""
        return dataclasses.asdict(self)


class _Timed:
    """Open one file and time its frames."""

    def __init__(self, session: ModelSession, choice: ModelChoice) -> None:
        self.session = session
        self.choice = choice
        self.detector = Detector(session)
        self.frames_s: list[float] = []
        self.runs_s: list[float] = []

    def frame(self, image: Image, clock: Clock) -> None:
        busy_s, started_ns = self.session.stats().busy_s, clock.now_ns()
        self.detector.detect(image)
        self.frames_s.append((clock.now_ns() - started_ns) / NS_PER_S)
        self.runs_s.append(self.session.stats().busy_s - busy_s)

    def row(self, shelf: ModelShelf) -> FileFigures:
        stats = self.session.stats()
        return FileFigures(
            variant=stats.variant,
            provider=stats.provider,
            frames=len(self.frames_s),
            frame_median_s=float(np.median(self.frames_s)),
            frame_p95_s=float(np.percentile(self.frames_s, 95)),
            run_median_s=float(np.median(self.runs_s)),
            run_p95_s=float(np.percentile(self.runs_s, 95)),
            load_s=stats.load_s,
            memory_mb=memory_mb(self.session, self.choice, shelf),
            notices=stats.notices,
        )


def bench(
    shelf: ModelShelf, model: StoredModel, choice: ModelChoice, images: Sequence[Image], rounds: int
) -> ModelFigures:
    """Measure every file that the choice's providers would take at some precision.

    Raises:
        InferenceError: a file cannot be run as the choice asks.
    """
    timed = list(_open_all(shelf, model, choice))
    try:
        for number in range(rounds):
            first = number % len(timed)
            for one in (*timed[first:], *timed[:first]):
                one.frame(images[number % len(images)], shelf.clock)
        rows = tuple(one.row(shelf) for one in timed)
    finally:
        for one in timed:
            one.detector.close()
    return ModelFigures(
        model=model.manifest.name, threads=choice.threads, rows=rows, int8_speedup=_speedup(rows)
    )


def _open_all(shelf: ModelShelf, model: StoredModel, choice: ModelChoice) -> Iterator[_Timed]:
    seen: set[Variant] = set()
    for precision in _PRECISIONS:
        asked = dataclasses.replace(choice, precision=precision)
        session = open_session(model, asked, engines=shelf.engines, clock=shelf.clock)
        if session.variant in seen:
            session.close()
            continue
        seen.add(session.variant)
        yield _Timed(session, asked)


def _speedup(rows: tuple[FileFigures, ...]) -> float | None:
    medians = {row.variant: row.run_median_s for row in rows}
    int8 = next((medians[variant] for variant in _INT8 if variant in medians), None)
    return medians[Variant.FP32] / int8 if int8 and Variant.FP32 in medians else None


def memory_mb(session: ModelSession, choice: ModelChoice, shelf: ModelShelf) -> float:
    """Return by how much a fresh process grows that opens the same file in the same way.

    Here, a second session would use again what the first one has given back.

    Raises:
        RunFailed: that process failed.
    """
    described = {
        "folder": str(session.model.folder),
        "variant": session.variant,
        "engines": str(shelf.engines),
        "choice": dataclasses.asdict(choice),
    }
    command = [sys.executable, "-m", __name__, json.dumps(described)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        last = done.stderr.strip().rpartition("\n")[2]
        raise RunFailed(f"{session.model.manifest.name}: no memory was measured: {last}")
    return float(done.stdout)


def main() -> None:
    """Open the model that the argument describes, and print by how much this process grew."""
    described = json.loads(sys.argv[1])
    folder = Path(described["folder"])
    values: dict[str, Any] = described["choice"]
    lists = {key: tuple(values[key]) for key in ("tiers", "providers")}
    choice = ModelChoice(**{**values, **lists})
    model = StoredModel(manifest=read_manifest(folder), folder=folder)
    session = open_session(
        model.only(Variant(described["variant"])),
        choice,
        engines=Path(described["engines"]),
        clock=MonotonicClock(),
    )
    sys.stdout.write(f"{session.stats().memory_mb:.3f}\n")


if __name__ == "__main__":
    main()
