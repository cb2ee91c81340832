"""Write the ear as the robot runs it, in eight bits, and enter it in the recogniser's manifest."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Final

import torch
from onnxruntime.quantization import QuantType, quantize_dynamic
from torch import Tensor, nn

from training.speech.network import MELS, Encoder
from training.stop_ear.network import SIZE, StopEar
from training.stop_ear.training import WEIGHTS
from vla_deploy.inference.file_check import sha256_of
from vla_deploy.inference.manifest import ModelFile
from vla_deploy.inference.manifest_file import read_manifest, write_manifest
from vla_deploy.speech.stop_ear import FILE, FRAMES, SCORES

OPSET: Final = 17
LONGEST_STATES: Final = 800
"""Of 40 ms: more than a phrase may last, and half as many places as the encoder has."""


class _Scores(nn.Module):
    """Give the mean of what each of the ears says; what only one takes for a stop weighs less."""

    def __init__(self, ears: Sequence[StopEar]) -> None:
        super().__init__()
        self.ears = nn.ModuleList(ears)

    def forward(self, frames: Tensor) -> Tensor:
        return torch.stack([torch.softmax(ear(frames), dim=2) for ear in self.ears]).mean(0)


def ship(outs: Sequence[Path], recogniser: Path) -> None:
    """Put the ears that were learnt, as one, beside the recogniser whose frames they hear.

    Raises:
        FileNotFoundError: nothing was learnt yet.
        ManifestInvalid: there is no recogniser.
    """
    path, manifest = recogniser / FILE, read_manifest(recogniser)
    export([learnt(out) for out in outs], path)
    others = (part for part in manifest.parts if part.path != FILE)
    parts = (*others, ModelFile(path=FILE, sha256=sha256_of(path)))
    write_manifest(recogniser, replace(manifest, parts=parts))


def learnt(out: Path) -> StopEar:
    """Return the ear with the weights of a training.

    Raises:
        FileNotFoundError: nothing was learnt yet.
    """
    ear = StopEar(Encoder(SIZE))
    ear.load_state_dict(torch.load(out / WEIGHTS, weights_only=True))
    return ear.eval()


def export(ears: Sequence[StopEar], path: Path) -> None:
    """Write ears as one in ONNX: weights of eight bits, all else of 32."""
    for ear in ears:
        places = ear.encoder.embed_positions
        places.weight = nn.Parameter(places.weight[:LONGEST_STATES].clone(), requires_grad=False)
    whole = path.with_suffix(".fp32")
    torch.onnx.export(
        _Scores(ears),
        (torch.zeros(1, MELS, 120),),
        str(whole),
        input_names=[FRAMES],
        output_names=[SCORES],
        dynamic_axes={FRAMES: {2: "frame"}, SCORES: {1: "time"}},
        opset_version=OPSET,
        dynamo=False,
    )
    quantize_dynamic(
        whole, path, op_types_to_quantize=["MatMul"], per_channel=True, weight_type=QuantType.QInt8
    )
    whole.unlink()
