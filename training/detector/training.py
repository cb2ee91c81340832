"""Train the network: seeded, one thread on a CPU, a GPU where there is one."""

import copy
import logging
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor

from training.detector.batches import make_batch
from training.detector.classes import CLASSES
from training.detector.dataset import Shard, load
from training.detector.losses import losses
from training.detector.network import CentreNet
from training.detector.settings import Settings
from training.warm_start import begin_from

WEIGHTS = "centre_net.pt"
STATE = "training_state.pt"
AVERAGE_DECAY = 0.999
WEIGHT_DECAY = 0.02
MAX_GRADIENT = 10.0
WARM_STEPS = 300
LAST_RATE_RATIO = 0.01
"""Learning rate at the end over the highest."""
TELL_EVERY_STEPS = 100
TYPICAL_IMAGES = 64
_LOG = logging.getLogger(__name__)


def train(out: Path, settings: Settings) -> None:
    """Train on the data under `out`; write the averaged weights there after each epoch.

    A training that was broken off goes on after its last whole epoch, with the same result.

    Raises:
        FileNotFoundError: the data are not there.
    """
    torch.manual_seed(settings.seed)
    torch.set_num_threads(settings.threads)
    device = torch.device("cuda" if torch.cuda.is_available() else "cpu")
    shard = load(out / "data", "train", settings.shard_count("train"))
    run = _Run(settings, device, len(shard.images) // settings.batch)
    if settings.start_from is not None:
        run.begin_from(settings.start_from, shard)
    for epoch in range(run.resume(out / STATE), settings.epochs + settings.settling_epochs):
        random = np.random.default_rng([settings.seed, 100, epoch])
        piece_px = settings.piece_px if epoch < settings.epochs else None
        order = random.permutation(len(shard.images))
        told = [
            run.step(*make_batch(shard, order[k : k + settings.batch], random, piece_px))
            for k in range(0, len(order) - settings.batch + 1, settings.batch)
        ]
        _LOG.info("epoch %d: things %.3f, names %.3f, boxes %.3f", epoch, *np.mean(told, axis=0))
        run.save(out / STATE, epoch + 1)
        _write(run.average.state_dict(), out / WEIGHTS)


def _write(values: dict[str, Any], path: Path) -> None:
    partial = path.with_suffix(".part")
    torch.save(values, partial)
    partial.rename(path)


class _Run:
    """Hold what a training changes."""

    def __init__(self, settings: Settings, device: torch.device, steps_per_epoch: int) -> None:
        self._device = device
        self._settings = settings
        self._per_epoch = steps_per_epoch
        self.model = CentreNet(len(CLASSES)).to(device).to(memory_format=torch.channels_last)  # type: ignore[call-overload]
        self.average = copy.deepcopy(self.model).eval()
        self._steps = 0
        self._optimiser = torch.optim.AdamW(self.model.parameters(), weight_decay=WEIGHT_DECAY)

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
        self._optimiser.load_state_dict(state["optimiser"])
        self._steps = state["steps"]
        return int(state["epoch"])

    def save(self, path: Path, epoch: int) -> None:
        """Write all that `resume` needs to go on with that epoch."""
        state = {
            "model": self.model.state_dict(),
            "average": self.average.state_dict(),
            "optimiser": self._optimiser.state_dict(),
            "steps": self._steps,
            "epoch": epoch,
        }
        _write(state, path)

    def step(self, images: Tensor, targets: list[Tensor]) -> list[float]:
        """Learn from one batch; return the losses of things, names and boxes."""
        images = images.to(self._device).contiguous(memory_format=torch.channels_last)
        images = images.to(torch.bfloat16).mul_(1 / 255)
        names, ignored, edges, share = (target.to(self._device) for target in targets)
        with torch.autocast(self._device.type, torch.bfloat16):
            maps = self.model.raw(images)
        parts = losses(maps, (names, ignored, edges, share))
        for group in self._optimiser.param_groups:
            group["lr"] = self._learning_rate()
        self._optimiser.zero_grad()
        torch.stack(parts).sum().backward()  # type: ignore[no-untyped-call]
        torch.nn.utils.clip_grad_norm_(self.model.parameters(), MAX_GRADIENT)
        self._optimiser.step()
        self._follow()
        values = [part.item() for part in parts]
        if self._steps % TELL_EVERY_STEPS == 0:
            _LOG.info("step %d: things %.3f, names %.3f, boxes %.3f", self._steps, *values)
        return values

    def _learning_rate(self) -> float:
        """Rise, stay, and fall while the training settles."""
        settings = self._settings
        rise = min(1.0, (self._steps + 1) / WARM_STEPS)
        settled = (self._steps / self._per_epoch - settings.epochs) / settings.settling_epochs
        fallen = min(1.0, max(0.0, settled))
        return settings.learning_rate * rise * (1 - (1 - LAST_RATE_RATIO) * fallen)

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
