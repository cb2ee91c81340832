"""Train the network: seeded, one thread on a CPU, a GPU where there is one."""

import copy
import logging
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from training.detector.batches import make_batch
from training.detector.classes import CLASSES
from training.detector.dataset import Shard, load
from training.detector.losses import losses
from training.detector.network import CentreNet
from training.detector.settings import DetectorSettings
from training.warm_start import begin_from

WEIGHTS = "centre_net.pt"
STATE = "training_state.pt"
AVERAGE_DECAY = 0.999
PLAIN_RATE_RATIO = 0.1
"""Learning rate of what Muon does not move, over its own."""
WEIGHT_DECAY, PLAIN_WEIGHT_DECAY = 0.05, 0.02
MAX_GRADIENT = 10.0
WARM_STEPS = 150
FALL_FROM = 0.2
"""Share of the epochs after which the learning rate falls, to nothing at the end."""
TELL_EVERY_STEPS = 250
TYPICAL_SHARDS, TYPICAL_IMAGES = 40, 64
_LOG = logging.getLogger(__name__)


def train(out: Path, settings: DetectorSettings) -> None:
    """Train on the data under `out`; write the averaged weights there after each epoch.

    A training that was broken off goes on after its last whole epoch, with the same result.

    Raises:
        FileNotFoundError: the data are not there.
    """
    torch.manual_seed(settings.seed)
    torch.set_num_threads(settings.threads)
    device = torch.device("cuda" if torch.cuda.is_available() else "cpu")
    run, shards = _Run(settings, device), settings.shard_count("train")
    if settings.start_from is not None:
        run.begin_from(settings.start_from, load(out / "data", "train", _typical(shards)))
    for epoch in range(run.resume(out / STATE), settings.epochs + settings.settling_epochs):
        random = np.random.default_rng([settings.seed, 100, epoch])
        numbers = random.permutation(shards)[: settings.epoch_shards]
        told = _learn(run, load(out / "data", "train", numbers), random, epoch)
        _LOG.info("epoch %d: things %.3f, names %.3f, boxes %.3f", epoch, *np.mean(told, axis=0))
        run.save(out / STATE, epoch + 1)
        _write(run.average.state_dict(), out / WEIGHTS)


def _typical(shards: int) -> NDArray[np.int_]:
    return np.linspace(0, shards - 1, min(shards, TYPICAL_SHARDS)).astype(int)


def _learn(run: "_Run", shard: Shard, random: np.random.Generator, epoch: int) -> list[list[float]]:
    """Learn from each image once; return the losses of all steps."""
    settings, told = run.settings, []
    left = random.permutation(len(shard.images))
    while len(left) >= settings.batch:
        done = 1 - len(left) / len(shard.images)
        whole = epoch >= settings.epochs or random.random() < settings.whole_share
        picks, left = np.split(left, [settings.whole_batch if whole else settings.batch])
        batch = make_batch(shard, picks, random, None if whole else settings.piece_px)
        told.append(run.step(*batch, learning_rate=_rate(settings, epoch + done)))
    return told


def _rate(settings: DetectorSettings, epochs: float) -> float:
    """Return the learning rate after so many epochs: steady at first, then falling to the end."""
    left = 1.0 - epochs / (settings.epochs + settings.settling_epochs)
    return settings.learning_rate * min(1.0, left / (1.0 - FALL_FROM))


def _write(values: dict[str, Any], path: Path) -> None:
    partial = path.with_suffix(".part")
    torch.save(values, partial)
    partial.rename(path)


class _Run:
    """Hold what a training changes."""

    def __init__(self, settings: DetectorSettings, device: torch.device) -> None:
        self._device = device
        self.settings = settings
        self.model = CentreNet(len(CLASSES)).to(device).to(memory_format=torch.channels_last)  # type: ignore[call-overload]
        self.average = copy.deepcopy(self.model).eval()
        self._steps = 0
        self._convolutions, rest = _split(self.model)
        self._matrices = [nn.Parameter(_as_matrix(one.detach())) for one in self._convolutions]
        self._optimisers: dict[float, torch.optim.Optimizer] = {
            1.0: torch.optim.Muon(self._matrices, weight_decay=WEIGHT_DECAY),
            PLAIN_RATE_RATIO: torch.optim.AdamW(rest, weight_decay=PLAIN_WEIGHT_DECAY),
        }
        """By their share of the learning rate."""

    def begin_from(self, path: Path, shard: Shard) -> None:
        """Take the weights of an exported model."""
        typical = np.linspace(0, len(shard.images) - 1, TYPICAL_IMAGES).astype(int)
        images = torch.from_numpy(shard.images[typical]).permute(0, 3, 1, 2).float() / 255
        begin_from(self.model, path, images.to(self._device))
        self.model.train()
        self.average.load_state_dict(self.model.state_dict())

    def resume(self, path: Path) -> int:
        """Load what was saved, if anything, and return the next epoch."""
        if not path.exists():
            return 0
        state = torch.load(path, map_location=self._device, weights_only=True)
        self.model.load_state_dict(state["model"])
        self.average.load_state_dict(state["average"])
        for optimiser, kept in zip(self._optimisers.values(), state["optimisers"], strict=True):
            optimiser.load_state_dict(kept)
        self._steps = state["steps"]
        return int(state["epoch"])

    def save(self, path: Path, epoch: int) -> None:
        """Write all that `resume` needs to go on with that epoch."""
        state = {
            "model": self.model.state_dict(),
            "average": self.average.state_dict(),
            "optimisers": [one.state_dict() for one in self._optimisers.values()],
            "steps": self._steps,
            "epoch": epoch,
        }
        _write(state, path)

    def step(self, images: Tensor, targets: list[Tensor], learning_rate: float) -> list[float]:
        """Learn from one batch; return the losses of things, names and boxes."""
        images = images.to(self._device).contiguous(memory_format=torch.channels_last)
        images = images.to(torch.bfloat16).mul_(1 / 255)
        names, ignored, edges, share = (target.to(self._device) for target in targets)
        with torch.autocast(self._device.type, torch.bfloat16):
            maps = self.model.raw(images)
        parts = losses(maps, (names, ignored, edges, share))
        self.model.zero_grad()
        torch.stack(parts).sum().backward()  # type: ignore[no-untyped-call]
        torch.nn.utils.clip_grad_norm_(self.model.parameters(), MAX_GRADIENT)
        self._move(learning_rate * min(1.0, (self._steps + 1) / WARM_STEPS))
        self._follow()
        values = [part.item() for part in parts]
        if self._steps % TELL_EVERY_STEPS == 0:
            _LOG.info("step %d: things %.3f, names %.3f, boxes %.3f", self._steps, *values)
        return values

    def _move(self, learning_rate: float) -> None:
        for matrix, convolution in zip(self._matrices, self._convolutions, strict=True):
            assert convolution.grad is not None
            matrix.grad = _as_matrix(convolution.grad)
        for share, optimiser in self._optimisers.items():
            for group in optimiser.param_groups:
                group["lr"] = share * learning_rate
            optimiser.step()

    @torch.no_grad()
    def _follow(self) -> None:
        """Move the averaged weights; in the beginning faster."""
        self._steps += 1
        decay = min(AVERAGE_DECAY, (1 + self._steps) / (10 + self._steps))
        kept, new = self.average.state_dict(), self.model.state_dict()
        for name, value in kept.items():
            if value.dtype.is_floating_point:
                value.lerp_(new[name], 1 - decay)
            else:
                value.copy_(new[name])


def _split(model: CentreNet) -> tuple[list[nn.Parameter], list[nn.Parameter]]:
    """Return the weights that Muon moves, and all others: the first and last layer, and vectors."""
    convolutions, rest = [], []
    for name, weight in model.named_parameters():
        inner = weight.ndim == 4 and not name.startswith(("stem.", "last."))
        (convolutions if inner else rest).append(weight)
    return convolutions, rest


def _as_matrix(weight: Tensor) -> Tensor:
    """Return a convolution's weights as Muon wants them: a view, since their channels lie last."""
    return weight.permute(0, 2, 3, 1).flatten(1)
