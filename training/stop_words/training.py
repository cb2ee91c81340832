"""Train the network: seeded, one thread on a CPU, for a time on the clock of that core."""

import copy
import logging
import time
from collections import deque
from pathlib import Path
from typing import Any, Final

import numpy as np
import torch
from torch import Tensor
from torch.nn import functional

from training.precision import multiplies_in_bfloat16
from training.stop_words.corpus import TRAIN, Clips
from training.stop_words.mixing import IGNORED, Mixer, Stretch, varied
from training.stop_words.network import StopNet
from training.stop_words.rooms import NoiseBank, NoiseFrames
from training.stop_words.settings import StopWordSettings
from training.stop_words.texts import WORDS
from training.warm_start import begin_from

WEIGHTS: Final = "stop_net.pt"
STATE: Final = "training_state.pt"
AVERAGE_DECAY: Final = 0.998
WEIGHT_DECAY: Final = 0.01
MAX_GRADIENT: Final = 5.0
WARM_RATIO: Final = 0.03
LAST_RATE_RATIO: Final = 0.01
SAVE_EVERY_STEPS: Final = 50
HARDEST_RATIO: Final = 0.03
"""Share of the frames without a word that count most: those that come nearest to one."""
FOOLED: Final = 0.15
PHONE_WEIGHTS: Final = (1.0, 0.3)
PHONES_UNTIL: Final = 0.4
"""Share of the time in which the network learns above all to tell sounds apart."""
TYPICAL: Final = 16
FIRST_POOL: Final = 80
POOL: Final = 400
"""Stretches that are shown again, each a few times: mixing one costs more than learning from it.
So many are mixed before the first step, and so many are held."""
_LOG = logging.getLogger(__name__)


def train(out: Path, settings: StopWordSettings) -> None:
    """Train on the clips under `out`; write averaged weights and all that resuming needs there.

    Raises:
        FileNotFoundError: nothing was spoken yet.
    """
    torch.manual_seed(settings.seed)
    torch.set_num_threads(1)
    run = _Run(settings)
    run.resume(out / STATE)
    others = Clips(out / "clips", TRAIN, "others")
    bank = NoiseBank(others, np.random.default_rng([settings.seed, 1]))
    mixer = Mixer(Clips(out / "clips", TRAIN, "stops"), others, bank, settings.stretch_s)
    if settings.start_from is not None and run.steps == 0:
        random = np.random.default_rng([settings.seed, 3])
        run.begin_from(settings.start_from, [mixer.stretch(random) for _ in range(TYPICAL)])
    noise = NoiseFrames(bank)
    began_s = time.process_time() - run.spent_s
    mixer.hard = run.hard
    random = np.random.default_rng([settings.seed, 4, run.steps])
    first = (mixer.stretch(random) for _ in range(FIRST_POOL))
    pool: deque[Stretch] = deque(first, maxlen=POOL)
    while run.done < 1.0:
        random = np.random.default_rng([settings.seed, 2, run.steps])
        fresh = [mixer.stretch(random) for _ in range(settings.fresh)]
        picked = random.integers(len(pool), size=settings.seen)
        seen = [varied(pool[int(k)], noise, random) for k in picked]
        run.step([*fresh, *seen], mixer)
        pool.extend(fresh)
        run.spent_s = time.process_time() - began_s
        if run.steps % SAVE_EVERY_STEPS == 0 or run.done >= 1.0:
            run.hard = mixer.hard
            run.save(out / STATE)
            _write(run.average.state_dict(), out / WEIGHTS)


def _write(values: dict[str, Any], path: Path) -> None:
    partial = path.with_suffix(".part")
    torch.save(values, partial)
    partial.rename(path)


class _Run:
    """Hold what a training changes."""

    def __init__(self, settings: StopWordSettings) -> None:
        self._settings = settings
        self.model = StopNet(len(WORDS)).to(memory_format=torch.channels_last)
        self.average = copy.deepcopy(self.model).eval()
        self.steps = 0
        self.spent_s = 0.0
        self.hard: list[int] = []
        self._told = np.zeros(5)
        self._optimiser = torch.optim.AdamW(self.model.parameters(), weight_decay=WEIGHT_DECAY)

    @property
    def done(self) -> float:
        """Return the share of the time that is spent."""
        return self.spent_s / (60.0 * self._settings.cpu_minutes)

    def begin_from(self, path: Path, typical: list[Stretch]) -> None:
        """Take the weights of an exported model; the phones' head, which is not in it, is new."""
        begin_from(self.model, path, torch.from_numpy(np.stack([one.frames.T for one in typical])))
        self.model.train()
        self.average.load_state_dict(self.model.state_dict())

    def resume(self, path: Path) -> None:
        """Load what was saved, if anything."""
        if not path.exists():
            return
        state = torch.load(path, weights_only=True)
        self.model.load_state_dict(state["model"])
        self.average.load_state_dict(state["average"])
        self._optimiser.load_state_dict(state["optimiser"])
        self.steps, self.spent_s = int(state["steps"]), float(state["spent_s"])
        self.hard = list(state["hard"])

    def save(self, path: Path) -> None:
        """Write all that `resume` needs."""
        state = {
            "model": self.model.state_dict(),
            "average": self.average.state_dict(),
            "optimiser": self._optimiser.state_dict(),
            "steps": self.steps,
            "spent_s": self.spent_s,
            "hard": self.hard,
        }
        _write(state, path)

    def step(self, stretches: list[Stretch], mixer: Mixer) -> None:
        """Learn from one batch, and let the mixer know what fooled the network."""
        frames = torch.from_numpy(np.stack([one.frames.T for one in stretches]))
        labels = torch.from_numpy(np.stack([one.labels for one in stretches]))
        for group in self._optimiser.param_groups:
            group["lr"] = self._learning_rate()
        phones = torch.from_numpy(np.stack([one.phones for one in stretches]))
        # A third quicker on processors that multiply in bfloat16, and no worse.
        with torch.autocast("cpu", torch.bfloat16, enabled=multiplies_in_bfloat16()):
            logits, named = (each.float() for each in self.model.with_phones(frames))
        words, quiet, hardest = _losses(logits, labels)
        sounds = functional.cross_entropy(named, phones, ignore_index=IGNORED)
        weight = PHONE_WEIGHTS[self.done >= PHONES_UNTIL]
        self._optimiser.zero_grad()
        (words + quiet + hardest + weight * sounds).backward()  # type: ignore[no-untyped-call]
        torch.nn.utils.clip_grad_norm_(self.model.parameters(), MAX_GRADIENT)
        self._optimiser.step()
        self._follow()
        fooled = _fooled(logits.detach(), labels, stretches)
        mixer.remember(fooled)
        self._tell(words.item(), quiet.item(), hardest.item(), sounds.item(), len(fooled))

    def _tell(self, *values: float) -> None:
        self._told += values
        if self.steps % SAVE_EVERY_STEPS == 0:
            told = self._told / SAVE_EVERY_STEPS
            self._told = np.zeros(5)
            text = (
                "step %d, %.0f %%: words %.4f, quiet %.4f, hardest %.4f, phones %.3f, fooled %.1f"
            )
            _LOG.info(text, self.steps, 100 * self.done, *told)

    def _learning_rate(self) -> float:
        """Rise, then fall along a cosine."""
        done = min(1.0, self.done)
        rise = min(1.0, (done + 1e-3) / WARM_RATIO)
        fall = 0.5 * (1.0 + np.cos(np.pi * done))
        low = LAST_RATE_RATIO
        return float(self._settings.highest_rate * rise * (low + (1.0 - low) * fall))

    @torch.no_grad()
    def _follow(self) -> None:
        """Move the averaged weights; in the beginning faster."""
        self.steps += 1
        decay = min(AVERAGE_DECAY, (1 + self.steps) / (10 + self.steps))
        kept, new = self.average.state_dict(), self.model.state_dict()
        for name, value in kept.items():
            if value.dtype.is_floating_point:
                value.lerp_(new[name], 1 - decay)
            else:
                value.copy_(new[name])


def _losses(logits: Tensor, labels: Tensor) -> tuple[Tensor, Tensor, Tensor]:
    """Return the loss where a word was, where none was, and of the worst of the latter."""
    each = functional.cross_entropy(logits, labels, ignore_index=IGNORED, reduction="none")
    words, none = each[labels > 0], each[labels == 0]
    hardest = torch.topk(none, max(1, int(HARDEST_RATIO * none.numel()))).values
    return words.sum() / max(1, words.numel()), none.mean(), hardest.mean()


def _fooled(logits: Tensor, labels: Tensor, stretches: list[Stretch]) -> list[int]:
    """Return the clips of other talk in which the network heard a word."""
    heard = 1.0 - torch.softmax(logits, dim=1)[:, 0]
    wrong = ((heard > FOOLED) & (labels == 0)).numpy()
    numbers = {int(n) for k, one in enumerate(stretches) for n in one.others[wrong[k]]}
    return sorted(numbers - {-1})
