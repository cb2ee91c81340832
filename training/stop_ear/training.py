"""Teach the head by the clock; the encoder stays as it was shipped."""

import logging
import time
from pathlib import Path
from typing import Final

import numpy as np
import torch
from torch import Tensor
from torch.nn import functional

from training.speech.network import Encoder
from training.speech.sizes import SIZES, Size
from training.speech.warm_start import NotReadable, weights_of
from training.stop_head.batches import IGNORED, Batch, Corpus
from training.stop_head.network import StopHead

WEIGHTS: Final = "stop_head.pt"
ENCODER: Final = "encoder."
RATE: Final = 2e-3
DECAY: Final = 0.02
WARM_STEPS: Final = 100
WORD_WEIGHT: Final = 3.0
"""Of a state that tells a word, against one that tells none: there are fifty times as many."""
TELL_EVERY_STEPS: Final = 50
_LOG = logging.getLogger(__name__)


def train(
    clips: Path, talk: Path | None, recogniser: Path, out: Path, minutes: float, seed: int
) -> None:
    """Learn for that long from the clips, and write the head's weights.

    `talk` are clips that the recogniser has learnt from. Where weights are already, it goes on from
    them.

    Raises:
        FileNotFoundError: there are no clips.
        NotReadable: the folder `recogniser` is none that `training.speech` made.
    """
    torch.manual_seed(seed)
    corpus = Corpus(clips, talk, np.random.default_rng([seed, 1]))
    encoder, head = encoder_of(recogniser, SIZES["full"]), StopHead(SIZES["full"].width)
    if (out / WEIGHTS).exists():
        head.load_state_dict(torch.load(out / WEIGHTS, weights_only=True))
    optimiser = torch.optim.AdamW(head.parameters(), weight_decay=DECAY)
    began_s, steps, progress = time.monotonic(), 0, 0.0
    while progress < 1.0:
        for batch in corpus.batches():
            progress = (time.monotonic() - began_s) / (60.0 * minutes)
            if progress >= 1.0:
                break
            rise = min(1.0, (steps + 1) / WARM_STEPS)
            for group in optimiser.param_groups:
                group["lr"] = RATE * rise * 0.5 * (1.0 + np.cos(np.pi * progress))
            loss = _step(encoder, head, optimiser, batch)
            steps += 1
            if steps % TELL_EVERY_STEPS == 0:
                _LOG.info("step %d, %.3f: loss %.4f", steps, progress, loss)
    out.mkdir(parents=True, exist_ok=True)
    torch.save(head.state_dict(), out / WEIGHTS)


def encoder_of(folder: Path, size: Size) -> Encoder:
    """Return the encoder of a shipped recogniser.

    Raises:
        NotReadable: its weights are of another size, or none.
    """
    path, encoder = folder / "model.bin", Encoder(size)
    values = {
        name.removeprefix(ENCODER): torch.from_numpy(rows)
        for name, rows in weights_of(path).items()
        if name.startswith(ENCODER)
    }
    missing, unknown = encoder.load_state_dict(values, strict=False)
    if unknown or set(missing) - {"embed_positions.weight"}:
        raise NotReadable(f"{path}: missing {missing}, unknown {unknown}; is it of this size?")
    return encoder.eval()


def _step(
    encoder: Encoder, head: StopHead, optimiser: torch.optim.Optimizer, batch: Batch
) -> float:
    with torch.no_grad(), torch.autocast("cpu", torch.bfloat16):
        states = encoder(batch.frames).float()
    loss = _loss(head(states), batch.targets)
    optimiser.zero_grad(set_to_none=True)
    loss.backward()  # type: ignore[no-untyped-call]
    optimiser.step()
    return float(loss.detach())


def _loss(logits: Tensor, targets: Tensor) -> Tensor:
    weights = torch.full((logits.shape[2],), WORD_WEIGHT)
    weights[0] = 1.0
    return functional.cross_entropy(
        logits.flatten(0, 1), targets.flatten(), weight=weights, ignore_index=IGNORED
    )
