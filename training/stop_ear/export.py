"""Write the head as the robot reads it, and enter it in the recogniser's manifest."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import torch

from training.stop_head.training import WEIGHTS
from vla_deploy.inference.file_check import sha256_of
from vla_deploy.inference.manifest import ModelFile
from vla_deploy.inference.manifest_file import read_manifest, write_manifest
from vla_deploy.speech.stop_head import FILE, TENSORS


def ship(out: Path, recogniser: Path) -> None:
    """Put the head that was learnt beside the recogniser that it was learnt for.

    Raises:
        FileNotFoundError: nothing was learnt yet.
        ManifestInvalid: there is no recogniser.
    """
    weights = torch.load(out / WEIGHTS, weights_only=True)
    path, manifest = recogniser / FILE, read_manifest(recogniser)
    np.savez(path, **{name: weights[name].numpy().astype(np.float32) for name in TENSORS})
    others = (part for part in manifest.parts if part.path != FILE)
    parts = (*others, ModelFile(path=FILE, sha256=sha256_of(path)))
    write_manifest(recogniser, replace(manifest, parts=parts))
