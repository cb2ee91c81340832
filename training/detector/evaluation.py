"""Run ONNX files on labelled images and write what came out as JSON."""

import json
import logging
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from training.detector.average_precision import (
    MATCH_IOU,
    SURE_SCORE,
    WEAK_SCORE,
    ClassFigures,
    judge,
)
from training.detector.dataset import Shard, load
from training.detector.files import FILES, METRICS
from training.detector.settings import DetectorSettings
from training.detector.targets import STRIDE_PX
from vla_deploy.inference.runtime import InferenceSession, SessionOptions
from vla_deploy.perception.detectors.boxes import Boxes
from vla_deploy.perception.detectors.centre_net import decode

SAME_CLASS_IOU = 0.5
"""Boxes of one class that overlap more are one thing, for the manifest too."""
LOW_SCORE = 0.01
"""Average precision needs also the boxes that nobody would trust."""
RECALLS = ("recall", "sure_recall")
_LOG = logging.getLogger(__name__)


def evaluate(
    folder: Path, data: Path, files: Mapping[str, str], settings: DetectorSettings
) -> None:
    """Judge the files, named by precision, on the held-out splits; write `metrics.json` there.

    Raises:
        FileNotFoundError: data or a model are not there.
    """
    report: dict[str, Any] = {
        "iou": MATCH_IOU,
        "sure_score": SURE_SCORE,
        "weak_score": WEAK_SCORE,
        "splits": {},
    }
    for split in ("heldout", "flat"):
        shard = load(data, split, range(settings.shard_count(split)))
        report["splits"][split] = {"images": len(shard.images), "models": {}}
        for precision, name in files.items():
            figures = judge_file(folder / name, shard)
            report["splits"][split]["models"][precision] = figures
            told = {key: round(figures[key], 4) for key in ("map50", "map75", *RECALLS)}
            _LOG.info("%s %s: %s", split, precision, told)
    text = json.dumps(report, indent=1) + "\n"
    (folder / METRICS).write_text(text, encoding="utf-8")


def judge_file(model: Path, shard: Shard) -> dict[str, Any]:
    """Return the figures of one ONNX file on labelled images."""
    found = list(run(model, shard.images))
    labels = rows_by_image(shard)
    return summary(judge(found, labels))


def run(model: Path, images: NDArray[np.uint8]) -> list[Boxes]:
    """Return the boxes that an ONNX file finds in each image (N x H x W x 3, RGB)."""
    options = SessionOptions()
    options.intra_op_num_threads = 1
    if model.name == FILES["int8_s8s8"]:
        # It is for TensorRT. What the CPU makes of such steps overflows on an x86 without VNNI:
        # of fresh scenes' things it saw 0.72 there, 0.94 step by step as the file says.
        options.add_session_config_entry("session.disable_quant_qdq", "1")
    session = InferenceSession(model, options, providers=["CPUExecutionProvider"])
    name = session.get_inputs()[0].name
    boxes = []
    for image in images:
        heat, edges = session.run(None, {name: as_input(image)})
        boxes.append(
            decode(
                heat[0],
                edges[0],
                stride_px=STRIDE_PX,
                score_threshold=LOW_SCORE,
                iou_threshold=SAME_CLASS_IOU,
            )
        )
    return boxes


def as_input(image: NDArray[np.uint8]) -> NDArray[np.float32]:
    """Return an RGB image as the network wants it: 1 x 3 x H x W, from 0 to 1."""
    return np.ascontiguousarray(image.transpose(2, 0, 1)[None], np.float32) / np.float32(255)


def rows_by_image(shard: Shard) -> list[NDArray[np.float32]]:
    """Return the label rows of each image."""
    bounds = np.searchsorted(shard.labels[:, 0], np.arange(len(shard.images) + 1))
    return [shard.labels[a:b] for a, b in pairwise(bounds)]


def summary(judgements: Mapping[str, ClassFigures]) -> dict[str, Any]:
    """Return mean figures over the classes that occur, and those of each class."""
    there = {name: found for name, found in judgements.items() if found.labels}
    labels = [found.labels for found in there.values()]
    return {
        "map50": float(np.mean([found.ap50 for found in there.values()])),
        "map75": float(np.mean([found.ap75 for found in there.values()])),
        **{
            key: _over_all([getattr(one, key) for one in there.values()], labels) for key in RECALLS
        },
        "labels": sum(labels),
        "classes": {
            name: {key: _rounded(value) for key, value in asdict(found).items()}
            for name, found in there.items()
        },
    }


def _over_all(ratios: Sequence[float], labels: Sequence[int]) -> float:
    """Return the ratio over all labels of those of each class."""
    return float(np.average(ratios, weights=labels))


def _rounded(value: float) -> float:
    return round(value, 4)
