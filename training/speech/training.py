"""Train by the clock: rise, stay, fall to nothing at the end of the time that is given.

What was learnt before the fall is kept, so that a longer training goes on from there.
"""

import copy
import json
import logging
import shutil
import signal
import time
from pathlib import Path
from typing import Any, Final

import numpy as np
import torch
from torch import Tensor, nn
from torch.nn import functional

from training.mean_weights import mean_of
from training.precision import multiplies_in_bfloat16
from training.speech.batches import ClipPool, Maker, SpeechBatch
from training.speech.card import METRICS, TRAINING, read_metrics
from training.speech.clips.framing import IGNORED
from training.speech.clips.sentences import draw_sentence
from training.speech.clips.spoiling import Spoiler
from training.speech.network import RecogniserNetwork
from training.speech.sizes import TrainingSize
from training.speech.tokens import TOKENIZER, Coder, make_tokenizer
from training.speech.warm_start import NotReadable, weights_of, widened

STATE: Final = "state.pt"
BEFORE_FALL: Final = "before_fall.pt"
WEIGHTS: Final = "weights.pt"
RATE_MATRICES: Final = 0.02
RATE_OTHERS: Final = 2.5e-3
WARM_STEPS: Final = 200
AVERAGE_DECAY: Final = 0.99
"""Of the averaged weights: what is written as a model at any time, while the rate is still high."""
FALL_FROM: Final = 0.55
"""Share of the time after which the rate of learning falls."""
SHORT_UNTIL: Final = 0.1
"""Share of the time in which only the shorter clips are learnt from, by a network that is new."""
SMOOTHING: Final = 0.05
STARTED_RATIO: Final = 0.25
"""Of the rates of learning, where a training begins with weights that were shipped."""
_SAVE_EVERY_STEPS: Final = 200
_TELL_EVERY_STEPS: Final = 50
_TALKERS: Final = 400
_WORDS: Final = "decoder.embed_tokens.weight"
_LOG = logging.getLogger(__name__)


def train(out: Path, size: TrainingSize, budget_s: float, start_from: Path | None = None) -> None:
    """Train on the clips under `out` for that long in all; go on where it was broken off.

    With `start_from`, the folder of a shipped recogniser, it begins with that one's weights.

    Raises:
        FileNotFoundError: there are no clips yet.
        NotReadable: what to start from gives no weights.
    """
    torch.manual_seed(size.seed)
    torch.set_num_threads(1)
    clips = ClipPool(out / "clips")
    if not clips.refresh():
        raise FileNotFoundError(f"{out / 'clips'}: no clips; make them by the step data")
    random = np.random.default_rng([size.seed, time.time_ns()])
    if start_from is not None and not (out / TOKENIZER).exists():
        shutil.copyfile(start_from / TOKENIZER, out / TOKENIZER)
    coder = _coder(out / TOKENIZER, size)
    talk = [clips.clips[int(n)].samples for n in random.integers(len(clips.clips), size=_TALKERS)]
    maker = Maker(coder, Spoiler(talk, random))
    run = _Run(out, size, coder.count, budget_s)
    if start_from is not None:
        run.begin_from(start_from)
    stopping = _Stopping()
    while run.progress() < 1.0:
        clips.refresh()
        early = start_from is None and run.progress() < SHORT_UNTIL
        for group in clips.groups(size.batch_s, random, 0.5 if early else 1.0):
            run.step(maker.make(group, random))
            if stopping.told:
                run.save(STATE)
                return
            if run.progress() >= 1.0 or (early and run.progress() >= SHORT_UNTIL):
                break
    run.finish()


def _coder(path: Path, size: TrainingSize) -> Coder:
    if not path.exists():
        random = np.random.default_rng(size.seed)
        texts = [draw_sentence(random) for _ in range(size.texts_for_tokens)]
        make_tokenizer(texts, size.text_tokens).save(str(path))
    return Coder.load(path)


class _Stopping:
    """Know when the process is asked to end: what was learnt is saved first."""

    def __init__(self) -> None:
        self.told = False
        for number in (signal.SIGTERM, signal.SIGINT):
            signal.signal(number, self._tell)

    def _tell(self, _number: int, _frame: object) -> None:
        self.told = True


class _Run:
    """Hold what a training changes, and its clock."""

    def __init__(self, out: Path, size: TrainingSize, tokens: int, budget_s: float) -> None:
        self._out = out
        self._budget_s = budget_s
        self._seed = size.seed
        self._heard_before_s = 0.0
        self.model = RecogniserNetwork(size, tokens)
        self.average = copy.deepcopy(self.model)
        self._optimisers = _optimisers(self.model)
        self._steps, self._spent_s, self._heard_s, self._fell = 0, 0.0, 0.0, False
        self._resume()
        self._began_s = time.monotonic()

    def begin_from(self, folder: Path) -> None:
        """Take the weights of a shipped recogniser, unless this training has begun already.

        Rates stay lower then: what is learnt is not to be shaken up. The head that names sounds was
        not shipped, and learns anew. One of half the width is widened.
        """
        self._heard_before_s = _heard_by(folder)
        if self._steps:
            return
        path = _model(folder)
        for optimiser in self._optimisers:
            for group in optimiser.param_groups:
                group["highest"] *= STARTED_RATIO
        stored = weights_of(path)
        width = self.model.decoder.embed_tokens.embedding_dim
        if 2 * stored[_WORDS].shape[1] == width:
            stored = widened(stored, self._seed)
        values = {name: torch.from_numpy(rows) for name, rows in stored.items()}
        missing, unknown = self.model.load_state_dict(values, strict=False)
        if unknown or any(not name.startswith("sounds.") for name in missing):
            raise NotReadable(f"{path}: missing {missing}, unknown {unknown}; is it of this size?")
        self.average.load_state_dict(self.model.state_dict())

    def progress(self) -> float:
        """Return the share of the time that has gone."""
        return (self._spent_s + time.monotonic() - self._began_s) / self._budget_s

    def _resume(self) -> None:
        """Go on from the newest state that fits; one that fell fits only the time it fell for."""
        for path in (self._out / STATE, self._out / BEFORE_FALL):
            if not path.exists():
                continue
            state = torch.load(path, weights_only=True)
            if state["fell_for_s"] in (0.0, self._budget_s):
                self._take(state)
                return

    def _take(self, state: dict[str, Any]) -> None:
        self.model.load_state_dict(state["model"])
        self.average.load_state_dict(state["average"])
        for optimiser, values in zip(self._optimisers, state["optimisers"], strict=True):
            optimiser.load_state_dict(values)
        self._steps, self._spent_s = state["steps"], state["spent_s"]
        self._heard_s, self._fell = state["heard_s"], state["fell_for_s"] > 0.0
        _LOG.info("goes on after %d steps, %.0f s", self._steps, self._spent_s)

    def save(self, name: str) -> None:
        """Write all that going on needs."""
        state = {
            "model": self.model.state_dict(),
            "average": self.average.state_dict(),
            "optimisers": [optimiser.state_dict() for optimiser in self._optimisers],
            "steps": self._steps,
            "spent_s": self.progress() * self._budget_s,
            "heard_s": self._heard_s,
            "fell_for_s": self._budget_s if self._fell else 0.0,
        }
        _write(state, self._out / name)

    def step(self, batch: SpeechBatch) -> None:
        """Learn from one batch."""
        if self.progress() >= FALL_FROM and not self._fell:
            self.save(BEFORE_FALL)
            self._fell = True
        text, sounds, right = _losses(self.model, batch)
        rate = self._rate()
        for optimiser in self._optimisers:
            for group in optimiser.param_groups:
                group["lr"] = group["highest"] * rate
            optimiser.zero_grad(set_to_none=True)
        sound_weight = 1.0 if self.progress() < 0.4 else 0.3
        (text + sound_weight * sounds).backward()  # type: ignore[no-untyped-call]
        nn.utils.clip_grad_norm_(self.model.parameters(), 2.0)
        for optimiser in self._optimisers:
            optimiser.step()
        self._follow()
        self._steps += 1
        self._heard_s += batch.duration_s
        if self._steps % _TELL_EVERY_STEPS == 0:
            _LOG.info(
                "step %d, %.3f: text %.3f, right %.3f, sounds %.3f, %.1f h heard, CPU %.0f s",
                self._steps, self.progress(), text.item(), right, sounds.item(),
                self._heard_s / 3600, time.process_time(),
            )  # fmt: skip
        if self._steps % _SAVE_EVERY_STEPS == 0:
            self.save(STATE)

    @torch.no_grad()
    def _follow(self) -> None:
        kept, new = list(self.average.parameters()), list(self.model.parameters())
        torch._foreach_lerp_(
            kept, new, 1.0 - min(AVERAGE_DECAY, (1 + self._steps) / (10 + self._steps))
        )

    def _rate(self) -> float:
        """Return the share of the highest rate of learning."""
        fall = max(0.0, (self.progress() - FALL_FROM) / (1.0 - FALL_FROM))
        return min(1.0, (self._steps + 1) / WARM_STEPS) * max(0.0, 1.0 - fall)

    def finish(self) -> None:
        """Write the weights and what they cost."""
        _write(self.average.state_dict(), self._out / WEIGHTS)
        told = {
            "steps": self._steps,
            "budget_s": self._budget_s,
            "heard_s": self._heard_s,
            "heard_before_s": self._heard_before_s,
            "seed": self._seed,
        }
        (self._out / TRAINING).write_text(json.dumps(told), encoding="utf-8")
        _LOG.info("done: %s", told)


def take_mean(out: Path, start_from: Path) -> None:
    """Replace the weights under `out` by the mean of them and those that they began with.

    A short training on other voices forgets some of the old ones; the mean has learnt most and
    forgets little (Wortsman et al., "Robust fine-tuning of zero-shot models", 2022). It is taken
    once.

    Raises:
        NotReadable: what it began with gives no weights.
    """
    told = json.loads((out / TRAINING).read_text(encoding="utf-8"))
    if told.get("is_mean"):
        _LOG.warning("%s: it is a mean already", out)
        return
    trained = torch.load(out / WEIGHTS, weights_only=True)
    began = {name: torch.from_numpy(rows) for name, rows in weights_of(_model(start_from)).items()}
    _write(trained | mean_of(began, {name: trained[name] for name in began}, 0.5), out / WEIGHTS)
    (out / TRAINING).write_text(json.dumps(told | {"is_mean": True}), encoding="utf-8")


def _model(folder: Path) -> Path:
    return folder / "model.bin"


def _heard_by(folder: Path) -> float:
    """Return how much sound a shipped recogniser has heard, with those that it went on from."""
    path = folder / METRICS
    training = read_metrics(path)["training"] if path.exists() else {}
    return float(training.get("heard_s", 0.0) + training.get("heard_before_s", 0.0))


def _losses(model: RecogniserNetwork, batch: SpeechBatch) -> tuple[Tensor, Tensor, float]:
    """Return the losses of text and sounds, and the share of tokens that are right."""
    with torch.autocast("cpu", torch.bfloat16, enabled=multiplies_in_bfloat16()):
        tokens, sounds = model(batch.frames, batch.tokens)
    targets = batch.targets.flatten()
    learnt = targets != IGNORED
    picked = tokens.flatten(0, 1)[learnt].float()
    text = functional.cross_entropy(picked, targets[learnt], label_smoothing=SMOOTHING)
    heard = sounds.shape[1]
    sound = functional.cross_entropy(
        sounds.flatten(0, 1).float(), batch.sounds[:, :heard].flatten(), ignore_index=IGNORED
    )
    right = float((picked.argmax(1) == targets[learnt]).float().mean())
    return text, sound, right


def _optimisers(model: nn.Module) -> list[torch.optim.Optimizer]:
    """Return Muon for the layers' matrices, AdamW for all else.

    Muon multiplies in bfloat16: AdamW has all where that is slow.
    """
    matrices: list[nn.Parameter] = []
    others: list[nn.Parameter] = []
    for name, value in model.named_parameters():
        if value.requires_grad:
            is_matrix = value.ndim == 2 and ".layers." in name and multiplies_in_bfloat16()
            (matrices if is_matrix else others).append(value)
    adam = torch.optim.AdamW(
        [{"params": others, "highest": RATE_OTHERS}],
        lr=RATE_OTHERS, betas=(0.9, 0.98), weight_decay=0.01,
    )  # fmt: skip
    if not matrices:
        return [adam]
    muon = torch.optim.Muon(
        [{"params": matrices, "highest": RATE_MATRICES}], lr=RATE_MATRICES, weight_decay=0.02
    )
    return [muon, adam]


def _write(values: dict[str, Any], path: Path) -> None:
    partial = path.with_suffix(".part")
    torch.save(values, partial)
    partial.rename(path)
