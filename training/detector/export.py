"""Write the trained network as ONNX: fp32, and int8 for CPUs and for TensorRT."""

import logging
from pathlib import Path

import numpy as np
import torch

from training.detector.classes import CLASSES
from training.detector.dataset import load
from training.detector.evaluation import as_input
from training.detector.files import FILES
from training.detector.network import CentreNet
from training.detector.scenes.drawing import HEIGHT_PX, WIDTH_PX
from training.detector.settings import DetectorSettings
from training.detector.training import WEIGHTS
from vla_deploy.inference.manifest import Variant
from vla_deploy.model_tools.detectors.quantising import write_int8

OPSET = 17
_LOG = logging.getLogger(__name__)


def export(out: Path, models: Path) -> None:
    """Write the fp32 file of the averaged weights.

    Raises:
        FileNotFoundError: nothing was trained yet.
    """
    models.mkdir(parents=True, exist_ok=True)
    model = CentreNet(len(CLASSES)).eval()
    model.load_state_dict(torch.load(out / WEIGHTS, map_location="cpu", weights_only=True))
    torch.onnx.export(
        model,
        (torch.zeros(1, 3, HEIGHT_PX, WIDTH_PX),),
        str(models / FILES["fp32"]),
        input_names=["image"],
        output_names=["heat", "edges"],
        opset_version=OPSET,
        dynamo=False,
    )
    _LOG.info("%s: %d bytes", FILES["fp32"], (models / FILES["fp32"]).stat().st_size)


def quantise(out: Path, models: Path, settings: DetectorSettings) -> None:
    """Write both int8 files, calibrated on training images.

    Raises:
        FileNotFoundError: the fp32 file or the data are not there.
    """
    random = np.random.default_rng([settings.seed, 200])
    numbers = random.permutation(settings.shard_count("train"))[: settings.calibration_images]
    shard = load(out / "data", "train", numbers)
    picks = random.permutation(len(shard.images))[: settings.calibration_images]
    paths = {Variant(name): models / file for name, file in FILES.items() if name != "fp32"}
    images = shard.images[picks]
    write_int8(
        models / FILES["fp32"], paths, lambda: ({"image": as_input(image)} for image in images)
    )
    for path in paths.values():
        _LOG.info("%s: %d bytes", path.name, path.stat().st_size)
