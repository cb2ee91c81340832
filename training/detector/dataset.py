"""Draw labelled images in shards; the same seed gives the same images, whatever is drawn first."""

import logging
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sim_twin.pictures.renderer import open_gl_context
from training.detector.labels import Label, label
from training.detector.scenes.drawing import HEIGHT_PX, WIDTH_PX, StageDrawing
from training.detector.scenes.dress import dress
from training.detector.scenes.flat_stage import build_flat
from training.detector.scenes.layout import arrange
from training.detector.scenes.parts import Random
from training.detector.scenes.pose import pose_robot
from training.detector.scenes.scene_model import SceneStage, build_studio
from training.detector.scenes.spoil import spoil

SPLITS = {"train": 1, "heldout": 2, "flat": 3}
"""Training; judging on unseen scenes, lights and textures; judging in the flat as it is."""
IMAGES_PER_SHARD = 20
EMPTY_KEPT_CHANCE = 0.3
FLAT_SHARE = 0.35
LABEL_COLUMNS = 7
"""Image, class, left, top, right, bottom, judged."""
_LOG = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True, kw_only=True)
class Shard:
    """Hold images (N x 384 x 512 x 3, RGB) and the rows of their labels."""

    images: NDArray[np.uint8]
    labels: NDArray[np.float32]


def shard_path(folder: Path, split: str, number: int) -> Path:
    """Return where a shard lies."""
    return folder / split / f"{number:04d}.npz"


def generate(folder: Path, split: str, numbers: range, seed: int) -> None:
    """Draw those shards of a split that are not there yet.

    Raises:
        OpenGLMissing: nothing can be rendered on this machine.
    """
    gl = open_gl_context(WIDTH_PX, HEIGHT_PX)
    for number in numbers:
        path = shard_path(folder, split, number)
        if path.exists():
            continue
        path.parent.mkdir(parents=True, exist_ok=True)
        shard = draw_shard(gl, split, number, seed)
        partial = path.with_suffix(".part")
        with partial.open("wb") as file:
            np.savez(file, images=shard.images, labels=shard.labels)
        partial.rename(path)
        _LOG.info("%s %d: %d labels", split, number, len(shard.labels))
    gl.free()


def draw_shard(
    gl: object, split: str, number: int, seed: int, count: int = IMAGES_PER_SHARD
) -> Shard:
    """Draw the images of one shard: one stage, arranged and lit anew for each image."""
    random = np.random.default_rng([seed, SPLITS[split], number])
    stage = _stage(random, split)
    drawing = StageDrawing(gl, stage)  # type: ignore[arg-type]
    drawn = [draw_image(stage, drawing, random) for _ in range(count)]
    drawing.close()
    rows = [
        (k, item.class_index, *item.box_px, item.judged)
        for k, (_, labels) in enumerate(drawn)
        for item in labels
    ]
    return Shard(
        images=np.stack([image for image, _ in drawn]),
        labels=np.array(rows, np.float32).reshape(-1, LABEL_COLUMNS),
    )


def _stage(random: Random, split: str) -> SceneStage:
    in_flat = random.random() < FLAT_SHARE or split == "flat"
    return build_flat(random, split) if in_flat else build_studio(random, split)


def draw_image(
    stage: SceneStage, drawing: StageDrawing, random: Random
) -> tuple[NDArray[np.uint8], list[Label]]:
    """Arrange, light and draw one image; return it with its labels. Few show nothing."""
    while True:
        stage.restore()
        layout = arrange(stage, random)
        pose_robot(stage, layout, random)
        dress(stage, layout, random)
        image, geoms = drawing.draw()
        labels = label(stage, layout, geoms, drawing.pixels_alone)
        if any(item.judged for item in labels) or random.random() < EMPTY_KEPT_CHANCE:
            return spoil(image, random), labels


def load(folder: Path, split: str, numbers: Iterable[int]) -> Shard:
    """Return those shards of a split as one; rows count images through.

    Raises:
        FileNotFoundError: a shard is missing.
    """
    images, labels, start = [], [], 0
    for number in numbers:
        path = shard_path(folder, split, number)
        if not path.exists():
            raise FileNotFoundError(
                f"{path}: no such shard; run `python -m training.detector data` first"
            )
        with np.load(path) as stored:
            rows = stored["labels"].copy()
            rows[:, 0] += start
            images.append(stored["images"])
            labels.append(rows)
        start += len(images[-1])
    return Shard(images=np.concatenate(images), labels=np.concatenate(labels))
