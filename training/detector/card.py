"""Write the model's card and manifest from what was measured."""

import json
from pathlib import Path
from string import Template
from typing import Any

from training.detector.average_precision import SURE_SCORE, WEAK_SCORE
from training.detector.classes import CLASSES
from training.detector.dataset import FLAT_SHARE, IMAGES_PER_SHARD
from training.detector.evaluation import RECALLS, SAME_CLASS_IOU
from training.detector.files import CARD, FILES, MANIFEST, METRICS
from training.detector.labels import LARGE_LEAST, MIN_SEEN_RATIO, NEAR_LONG_PX, SMALL_LEAST
from training.detector.scenes.drawing import HEIGHT_PX, WIDTH_PX
from training.detector.settings import DetectorSettings
from training.detector.targets import STRIDE_PX
from vla_deploy.inference.store import sha256_of

AIM_MAP50, AIM_RECALL = 0.90, 0.93
TEMPLATE = Path(__file__).with_name("card_template.md")
MANIFEST_TEMPLATE = Path(__file__).with_name("manifest_template.toml")
TITLES = {
    "heldout": "Unseen scenes, lights and textures",
    "flat": "The flat of the twin as it is, with things not seen in training",
}
BEGAN = "It began with the weights of the model that was shipped before it, not with random ones."


def describe(models: Path, settings: DetectorSettings) -> None:
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
    heads = " | ".join(f"AP50 {name}" for name in FILES)
    lines = [
        f"### {title}: {metrics['splits'][split]['images']} images, {best['labels']} things",
        "",
        f"| class | things | {heads} | AP75 fp32 | recall | sure recall | precision |",
        f"|---|{'---|' * (len(FILES) + 5)}",
    ]
    for name in (name for name in CLASSES if name in best["classes"]):
        row = best["classes"][name]
        each = " | ".join(f"{models[file]['classes'][name]['ap50']:.3f}" for file in FILES)
        lines.append(
            f"| {name} | {row['labels']} | {each} | {row['ap75']:.3f} "
            f"| {row['recall']:.3f} | {row['sure_recall']:.3f} | {row['precision']:.3f} |"
        )
    each = " | ".join(f"**{models[file]['map50']:.3f}**" for file in FILES)
    recalls = " | ".join(
        " / ".join(f"{models[file][key]:.3f}" for file in FILES) for key in RECALLS
    )
    lines.append(f"| mean | {best['labels']} | {each} | {best['map75']:.3f} | {recalls} | |")
    return "\n".join([*lines, ""])


def verdict(metrics: dict[str, Any]) -> str:
    """Return a sentence on whether the fp32 file does on unseen scenes what is asked of it."""
    told = metrics["splits"]["heldout"]["models"]["fp32"]
    figures = (
        f"mAP50 {told['map50']:.3f} and recall {told['recall']:.3f} on unseen scenes "
        f"({told['sure_recall']:.3f} by sure boxes)"
    )
    if told["map50"] >= AIM_MAP50 and told["recall"] >= AIM_RECALL:
        return f"It reaches its aim ({AIM_MAP50:.2f}, {AIM_RECALL:.2f}): {figures}."
    return (
        f"**It does not reach its aim of mAP50 {AIM_MAP50:.2f} and recall {AIM_RECALL:.2f}: it has "
        f"{figures}.** Do not let the robot act on it alone; train it longer, on more images."
    )


def card(metrics: dict[str, Any], models: Path, settings: DetectorSettings) -> str:
    """Return the model card."""
    sizes = ", ".join(
        f"`{name}` {(models / name).stat().st_size // 1024} KiB" for name in FILES.values()
    )
    images = settings.shard_count("train") * IMAGES_PER_SHARD
    values = {
        "verdict": verdict(metrics),
        "classes": ", ".join(CLASSES),
        "sizes": sizes,
        "width_px": WIDTH_PX,
        "height_px": HEIGHT_PX,
        "rows": HEIGHT_PX // STRIDE_PX,
        "columns": WIDTH_PX // STRIDE_PX,
        "images": images,
        "flat_share": f"{FLAT_SHARE:.0%}",
        "per_shard": IMAGES_PER_SHARD,
        "small_pixels": SMALL_LEAST.pixels,
        "small_long_px": f"{SMALL_LEAST.long_px:.0f}",
        "small_inside": f"{SMALL_LEAST.in_image:.0%}",
        "large_inside": f"{LARGE_LEAST.in_image:.0%}",
        "near_px": f"{NEAR_LONG_PX:.0f}",
        "large_pixels": LARGE_LEAST.pixels,
        "large_long_px": f"{LARGE_LEAST.long_px:.0f}",
        "min_seen": f"{MIN_SEEN_RATIO:.0%}",
        "sure_score": metrics["sure_score"],
        "weak_score": metrics["weak_score"],
        "tables": tables(metrics),
        "calibration_images": settings.calibration_images,
        "size": settings.name,
        "more": " --start-from MODEL" if settings.start_from else "",
        "began": f"{BEGAN}\n" if settings.start_from else "",
        "seed": settings.seed,
        "epochs": settings.epochs,
        "epoch_images": settings.epoch_shards * IMAGES_PER_SHARD,
        "settling_epochs": settings.settling_epochs,
    }
    return Template(TEMPLATE.read_text(encoding="utf-8")).substitute(values)


def measured(metrics: dict[str, Any]) -> tuple[float, float]:
    """Return precision, a mean over classes, and recall of the CPU's int8 file by sure boxes."""
    told = metrics["splits"]["heldout"]["models"]["int8_u8s8"]
    classes = told["classes"].values()
    return sum(one["precision"] for one in classes) / len(classes), told["sure_recall"]


def manifest(models: Path) -> str:
    """Return the manifest that the runtime reads, with what the files were measured at."""
    precision, recall = measured(json.loads((models / METRICS).read_text(encoding="utf-8")))
    files = "\n".join(
        f'[files.{key}]\npath = "{name}"\nsha256 = "{sha256_of(models / name)}"\n'
        for key, name in FILES.items()
    )
    values = {
        "card": CARD,
        "files": files,
        "classes": json.dumps(CLASSES),
        "class_count": len(CLASSES),
        "sure_score": SURE_SCORE,
        "weak_score": WEAK_SCORE,
        "same_class_iou": SAME_CLASS_IOU,
        "precision": f"{precision:.3f}",
        "recall": f"{recall:.3f}",
        "width_px": WIDTH_PX,
        "height_px": HEIGHT_PX,
        "rows": HEIGHT_PX // STRIDE_PX,
        "columns": WIDTH_PX // STRIDE_PX,
        "scale": repr(1 / 255),
    }
    return Template(MANIFEST_TEMPLATE.read_text(encoding="utf-8")).substitute(values)
