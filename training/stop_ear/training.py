"""Teach the ear by the clock; what it takes for something else comes again soon."""

import logging
import time
from pathlib import Path
from typing import Final

import numpy as np
import torch
from torch import Tensor
from torch.nn import functional

from training.mean_weights import mean_of
from training.speech.network import Encoder
from training.speech.warm_start import NotReadable, weights_of
from training.stop_ear.batches import IGNORED, Batch, Corpus
from training.stop_ear.network import SIZE, StopEar
from training.stop_ear.shipped import shipped_weights

WEIGHTS: Final = "stop_ear.pt"
ENCODER: Final = "encoder."
RATE: Final = 4e-4
DECAY: Final = 0.02
MAX_GRADIENT: Final = 1.0
WARM_STEPS: Final = 200
WORD_WEIGHT: Final = 3.0
"""Of a state that tells a word, against one that tells none: there are fifty times as many."""
WRONG: Final = 1.0
"""The loss of the worst state of a clip from which on it comes again."""
TELL_EVERY_STEPS: Final = 50
SAVE_EVERY_STEPS: Final = 500
_LOG = logging.getLogger(__name__)


def train(
    clips: Path, talk: Path | None, recogniser: Path, out: Path, minutes: float, seed: int,
    start_from: Path | None = None,
) -> None:  # fmt: skip
    """Learn for that long from the clips, and write the weights.

    `talk` are clips that the recogniser has learnt from. Where weights are already, it goes on from
    them, else from those of the first ear that was shipped, else from the recogniser's.

    Raises:
        FileNotFoundError: there are no clips.
        NotReadable: the folder `recogniser` is none that `training.speech` made.
        RuntimeError: `start_from` is an ear of another size.
    """
    torch.manual_seed(seed)
    torch.set_num_threads(1)
    out.mkdir(parents=True, exist_ok=True)
    corpus = Corpus(clips, talk, np.random.default_rng([seed, 1]))
    ear = StopEar(encoder_of(recogniser)).train()
    if (out / WEIGHTS).exists():
        ear.load_state_dict(torch.load(out / WEIGHTS, weights_only=True))
    elif start_from is not None:
        ear.load_state_dict(ear.state_dict() | shipped_weights(start_from)[0])
    learnt = [values for values in ear.parameters() if values.requires_grad]
    optimiser = torch.optim.AdamW(learnt, weight_decay=DECAY)
    began_s, steps, progress, told = time.monotonic(), 0, 0.0, np.zeros(2)
    while progress < 1.0:
        for batch in corpus.batches():
            progress = (time.monotonic() - began_s) / (60.0 * minutes)
            if progress >= 1.0:
                break
            for group in optimiser.param_groups:
                group["lr"] = _rate(steps, progress)
            loss, wrong = _step(ear, optimiser, batch)
            corpus.remember(wrong)
            steps, told = steps + 1, told + np.array((loss, len(wrong) / len(batch.numbers)))
            if steps % TELL_EVERY_STEPS == 0:
                mean = told / TELL_EVERY_STEPS
                _LOG.info("step %d, %.3f: loss %.4f, wrong %.3f", steps, progress, *mean)
                told[:] = 0.0
            if steps % SAVE_EVERY_STEPS == 0:
                torch.save(ear.state_dict(), out / WEIGHTS)
    torch.save(ear.state_dict(), out / WEIGHTS)


def mean(out: Path, other: Path, into: Path) -> None:
    """Write the mean of the weights under `out` and `other`, which began from the same, `into`.

    Raises:
        FileNotFoundError: one of them has not been trained.
        ValueError: they are not of one shape.
    """
    weights = mean_of(other / WEIGHTS, out / WEIGHTS, 0.5)
    into.mkdir(parents=True, exist_ok=True)
    torch.save(weights, into / WEIGHTS)


def encoder_of(folder: Path) -> Encoder:
    """Return the encoder of a shipped recogniser.

    Raises:
        NotReadable: its weights are of another size, or none.
    """
    path, encoder = folder / "model.bin", Encoder(SIZE)
    values = {
        name.removeprefix(ENCODER): torch.from_numpy(rows)
        for name, rows in weights_of(path).items()
        if name.startswith(ENCODER)
    }
    missing, unknown = encoder.load_state_dict(values, strict=False)
    if unknown or set(missing) - {"embed_positions.weight"}:
        raise NotReadable(f"{path}: missing {missing}, unknown {unknown}; is it of this size?")
    return encoder


def _rate(steps: int, progress: float) -> float:
    """Rise over the first steps, then fall along a cosine."""
    rise = min(1.0, (steps + 1) / WARM_STEPS)
    return float(RATE * rise * 0.5 * (1.0 + np.cos(np.pi * progress)))


def _step(ear: StopEar, optimiser: torch.optim.Optimizer, batch: Batch) -> tuple[float, list[int]]:
    """Learn from a batch; return its loss, and the clips in which a state went wrong."""
    with torch.autocast("cpu", torch.bfloat16):
        logits = ear(batch.frames).float()
    loss, worst = _losses(logits, batch.targets)
    optimiser.zero_grad(set_to_none=True)
    loss.backward()  # type: ignore[no-untyped-call]
    torch.nn.utils.clip_grad_norm_(ear.parameters(), MAX_GRADIENT)
    optimiser.step()
    return float(loss.detach()), [batch.numbers[int(k)] for k in (worst > WRONG).nonzero()]


def _losses(logits: Tensor, targets: Tensor) -> tuple[Tensor, Tensor]:
    """Return the mean loss, and of each clip that of its worst state."""
    weights = torch.where(targets > 0, WORD_WEIGHT, (targets == 0).float())
    each = functional.cross_entropy(
        logits.transpose(1, 2), targets, ignore_index=IGNORED, reduction="none"
    )
    return (weights * each).sum() / weights.sum(), each.detach().amax(1)
