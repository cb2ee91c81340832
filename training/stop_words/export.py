"""Write the trained network as ONNX, for the pieces that a stream comes in."""

import logging
from pathlib import Path
from typing import Final

import torch

from training.stop_words.network import REACH, Scores, StopNet
from training.stop_words.texts import WORDS
from training.stop_words.training import WEIGHTS
from vla_deploy.speech.stop_words.features import BANDS, STRIDE

OPSET: Final = 17
FILE: Final = "stop_words.onnx"
INPUT, OUTPUT = "frames", "scores"
MOMENTS: Final = 2
"""Per run on board, which is so one for each 40 ms."""
FRAMES: Final = REACH + STRIDE * (MOMENTS - 1)
_LOG = logging.getLogger(__name__)


def trained(out: Path) -> StopNet:
    """Return the network with the averaged weights.

    Raises:
        FileNotFoundError: nothing was trained yet.
    """
    net = StopNet(len(WORDS)).eval()
    net.load_state_dict(torch.load(out / WEIGHTS, map_location="cpu", weights_only=True))
    return net


def export(out: Path, models: Path) -> None:
    """Write the file.

    Raises:
        FileNotFoundError: nothing was trained yet.
    """
    models.mkdir(parents=True, exist_ok=True)
    torch.onnx.export(
        Scores(trained(out)),
        (torch.zeros(1, BANDS, FRAMES),),
        str(models / FILE),
        input_names=[INPUT],
        output_names=[OUTPUT],
        opset_version=OPSET,
        dynamo=False,
    )
    _LOG.info("%s: %d bytes", FILE, (models / FILE).stat().st_size)
