"""Write the trained network as ONNX: fp32, and int8 for CPUs and for TensorRT."""

import logging
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import onnx
import torch
from numpy.typing import NDArray
from onnxruntime.quantization import (
    CalibrationDataReader,
    QuantFormat,
    QuantType,
    quant_pre_process,
    quantize_static,
)

from training.detector.classes import CLASSES
from training.detector.dataset import load
from training.detector.drawing import HEIGHT_PX, WIDTH_PX
from training.detector.evaluation import as_input
from training.detector.files import FILES
from training.detector.network import CentreNet
from training.detector.settings import Settings
from training.detector.training import WEIGHTS

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


def quantise(out: Path, models: Path, settings: Settings) -> None:
    """Write both int8 files, calibrated on training images.

    Raises:
        FileNotFoundError: the fp32 file or the data are not there.
    """
    shard = load(out / "data", "train", settings.shard_count("train"))
    random = np.random.default_rng([settings.seed, 200])
    picks = random.permutation(len(shard.images))[: settings.calibration_images]
    with tempfile.TemporaryDirectory() as folder:
        prepared = Path(folder) / "prepared.onnx"
        quant_pre_process(str(models / FILES["fp32"]), str(prepared), skip_symbolic_shape=True)
        for precision, signed in (("int8_u8s8", False), ("int8_s8s8", True)):
            _quantise(prepared, models / FILES[precision], shard.images[picks], signed)


def _quantise(source: Path, target: Path, images: NDArray[np.uint8], signed: bool) -> None:
    options = {"ActivationSymmetric": True, "WeightSymmetric": True} if signed else {}
    quantize_static(
        str(source),
        str(target),
        _Calibration(images),
        quant_format=QuantFormat.QDQ,
        per_channel=True,
        activation_type=QuantType.QInt8 if signed else QuantType.QUInt8,
        weight_type=QuantType.QInt8,
        nodes_to_exclude=tail(onnx.load(str(source)).graph),
        extra_options=options,
    )
    _LOG.info("%s: %d bytes", target.name, target.stat().st_size)


def tail(graph: Any) -> list[str]:
    """Return the nodes that stay fp32: the last convolution and all that follows.

    Heat and distances share that layer's output; one scale for both would spoil the heat.
    """
    makers = {output: node for node in graph.node for output in node.output}
    found: dict[str, None] = {}
    wanted = [output.name for output in graph.output]
    while wanted:
        node = makers.get(wanted.pop())
        if node is None or node.name in found:
            continue
        found[node.name] = None
        if node.op_type != "Conv":
            wanted.extend(node.input)
    return list(found)


class _Calibration(CalibrationDataReader):
    """Give the images one by one."""

    def __init__(self, images: NDArray[np.uint8]) -> None:
        self._left: Iterator[NDArray[np.uint8]] = iter(images)

    def get_next(self) -> dict[str, NDArray[np.float32]] | None:
        image = next(self._left, None)
        return None if image is None else {"image": as_input(image)}
