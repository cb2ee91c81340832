"""Write the model's card and manifest from what was measured."""

import hashlib
import json
from pathlib import Path
from typing import Any

from training.detector.classes import CLASSES
from training.detector.dataset import FLAT_SHARE, IMAGES_PER_SHARD
from training.detector.drawing import HEIGHT_PX, WIDTH_PX
from training.detector.files import CARD, FILES, MANIFEST, METRICS
from training.detector.labels import MIN_LONG_PX, MIN_PIXELS, MIN_SEEN_RATIO
from training.detector.settings import Settings
from training.detector.targets import STRIDE_PX
from vla_deploy.perception.centre_net import MIN_SCORE, SAME_CLASS_IOU

TITLES = {
    "heldout": "Unseen scenes, lights and textures",
    "flat": "The flat of the twin as it is, with things not seen in training",
}


def describe(models: Path, settings: Settings) -> None:
    """Write `card.md` and `model.toml` beside the files that they describe.

    Raises:
        FileNotFoundError: the model or its metrics are not there.
    """
    metrics = json.loads((models / METRICS).read_text(encoding="utf-8"))
    (models / CARD).write_text(card(metrics, models, settings), encoding="utf-8")
    (models / MANIFEST).write_text(manifest(models), encoding="utf-8")


def tables(metrics: dict[str, Any]) -> str:
    """Return the accuracy of each class on each set of images as tables."""
    return "\n".join(_table(metrics, split, title) for split, title in TITLES.items())


def _table(metrics: dict[str, Any], split: str, title: str) -> str:
    models = metrics["splits"][split]["models"]
    best = models["fp32"]
    lines = [
        f"### {title}: {metrics['splits'][split]['images']} images, {best['labels']} things",
        "",
        f"| class | things | {' | '.join(f'AP50 {name}' for name in FILES)} | AP75 fp32 | recall | precision |",
        f"|---|{'---|' * (len(FILES) + 4)}",
    ]
    for name in (name for name in CLASSES if name in best["classes"]):
        row = best["classes"][name]
        each = " | ".join(f"{models[file]['classes'][name]['ap50']:.3f}" for file in FILES)
        lines.append(
            f"| {name} | {row['labels']} | {each} | {row['ap75']:.3f} "
            f"| {row['recall']:.3f} | {row['precision']:.3f} |"
        )
    each = " | ".join(f"**{models[file]['map50']:.3f}**" for file in FILES)
    recall = " / ".join(f"{models[file]['recall']:.3f}" for file in FILES)
    lines.append(f"| mean | {best['labels']} | {each} | {best['map75']:.3f} | {recall} | |")
    return "\n".join([*lines, ""])


def card(metrics: dict[str, Any], models: Path, settings: Settings) -> str:
    """Return the model card."""
    sizes = ", ".join(
        f"`{name}` {(models / name).stat().st_size // 1024} KiB" for name in FILES.values()
    )
    images = settings.shard_count("train") * IMAGES_PER_SHARD
    return f"""# detector

Finds household things, people and chairs in a {WIDTH_PX} x {HEIGHT_PX} colour image: {", ".join(CLASSES)}.
Colours are not its business; they are measured from the pixels.

Files: {sizes}. `int8_u8s8` is for CPUs, `int8_s8s8` for TensorRT; the last convolution and what
follows stay fp32 in both. Input: `image`, 1 x 3 x {HEIGHT_PX} x {WIDTH_PX}, RGB from 0 to 1. Outputs: `heat`, classes x
{HEIGHT_PX // STRIDE_PX} x {WIDTH_PX // STRIDE_PX}, and `edges`, distances in pixels from each cell's centre to the box's left, top,
right and bottom edge; `vla_deploy/perception/centre_net.py` reads them.

## Data

{images} training images, all drawn by the twin's renderer (`training/detector`): {FLAT_SHARE:.0%} of the stages are the flat
with its furniture repainted, the others rooms of random tables, walls and floors. Things are drawn
anew for each {IMAGES_PER_SHARD} images: size, shape, colour, texture, how they lie, in containers, on books, in the
robot's hand, partly hidden. The camera is the robot's, its height, tilt, opening and exposure varied.
Labels come from a segmentation render. A thing counts where at least {MIN_PIXELS} of its pixels are seen, its box
is {MIN_LONG_PX:.0f} px long and at least {MIN_SEEN_RATIO:.0%} of what it would fill; others may be found or not. No photograph was used.

Calibration of the int8 files: {settings.calibration_images} training images drawn with the training's seed ({settings.seed}), minimum and
maximum of each tensor, weights per channel.

## Accuracy

A class's AP50 is the area under its curve of precision over recall at an overlap of 0.5. Recall is the
share of things whose centre lies in a box of the right class with a score of {metrics["sure_score"]} or more; precision
the share of such boxes that fit a thing. The last row's recall is that of the three files in order. Figures are those
of `metrics.json`. The unseen textures come from families that training never shows; half of the scenes have a single hard lamp.

{tables(metrics)}
## What it cannot do

- **Real photographs.** It has seen renders alone: simple shapes, no shadows, no reflections, no camera's
  own processing. What it makes of a real camera's images is unknown. Retrain, or add a detector of your own by
  `vla-deploy models add`.
- Things smaller than about {MIN_LONG_PX:.0f} px: keys beyond two metres.
- Shapes outside its builders: a cup is a mug or tumbler, a chair has a seat of 0.14 to 0.26 m half width.
- Tell what is no thing of its classes from them reliably: toys, vases and tins of odd shapes get names.
- People: figures of capsules. It must not be the only thing that keeps a robot away from people.

## Made by

    python -m training.detector all --out DIR

Everything is seeded. {settings.epochs} epochs on pieces of images, then {settings.settling_epochs} on whole ones.
"""


def manifest(models: Path) -> str:
    """Return the manifest that the runtime reads."""
    rows, columns = HEIGHT_PX // STRIDE_PX, WIDTH_PX // STRIDE_PX
    files = "\n".join(
        f'[files.{key}]\npath = "{name}"\nsha256 = "{_digest(models / name)}"\n'
        for key, name in FILES.items()
    )
    return f"""name = "detector"
role = "detector"
summary = "Household things, people and chairs, trained on renders of the twin"
licence = "Apache-2.0"
card = "{CARD}"

{files}
[detection]
adapter = "centre_net"
classes = {json.dumps(CLASSES)}
score_threshold = {MIN_SCORE}
iou_threshold = {SAME_CLASS_IOU}

[detection.image]
width_px = {WIDTH_PX}
height_px = {HEIGHT_PX}
layout = "nchw"
colour = "rgb"
fit = "letterbox"
fill = 114
scale = {1 / 255!r}
mean = [0.0, 0.0, 0.0]
std = [1.0, 1.0, 1.0]

[[inputs]]
name = "image"
shape = [1, 3, {HEIGHT_PX}, {WIDTH_PX}]
dtype = "float32"

[[outputs]]
name = "heat"
shape = [1, {len(CLASSES)}, {rows}, {columns}]
dtype = "float32"

[[outputs]]
name = "edges"
shape = [1, 4, {rows}, {columns}]
dtype = "float32"
"""


def _digest(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()
