"""Train the decoder for a given time, on batches that are always new; broken off, it goes on."""

import logging
import math
import shutil
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from random import Random
from typing import Any, Final

import torch
from tokenizers import Tokenizer
from torch import Tensor, nn
from torch.nn import functional

from training.planner.files import TOKENIZER
from training.planner.network import PlanDecoder, deepened
from training.planner.sentences.composing import Composer, Example
from training.planner.settings import PlannerSettings
from training.planner.tokens import END, PAD, load_tokenizer, prompt_of, train_tokenizer

# Longer ones are rare, and would make a batch of their own.
MOST_TOKENS = 112


@dataclass(frozen=True, slots=True)
class TokenBatch:
    """Hold token numbers, batch x tokens, and which of them the model has to tell."""

    tokens: Tensor
    is_answer: Tensor


def batches(
    composer: Composer, tokenizer: Tokenizer, random: Random, size: int, pool: int
) -> Iterator[TokenBatch]:
    """Yield batches without end."""
    while True:
        examples = [composer.example(random) for _ in range(pool)]
        yield from pool_batches(examples, tokenizer, random, size)


def pool_batches(
    examples: list[Example], tokenizer: Tokenizer, random: Random, size: int
) -> Iterator[TokenBatch]:
    """Yield the examples once, in batches of like lengths, by chance one after the other."""
    prompts = tokenizer.encode_batch([prompt_of(one.command) for one in examples])
    answers = tokenizer.encode_batch([one.answer + END for one in examples])
    pairs = [(prompt.ids, answer.ids) for prompt, answer in zip(prompts, answers, strict=True)]
    pairs = [pair for pair in pairs if sum(map(len, pair)) <= MOST_TOKENS]
    pairs.sort(key=lambda pair: (sum(map(len, pair)), random.random()))
    starts = list(range(0, len(pairs) - size + 1, size)) or [0]
    random.shuffle(starts)
    pad = tokenizer.token_to_id(PAD)
    for start in starts:
        yield padded(pairs[start : start + size], pad)


def padded(pairs: list[tuple[list[int], list[int]]], pad: int) -> TokenBatch:
    """Return a batch of prompts and answers, each padded behind."""
    longest = max(len(prompt) + len(answer) for prompt, answer in pairs)
    tokens = torch.full((len(pairs), longest), pad)
    is_answer = torch.zeros((len(pairs), longest), dtype=torch.bool)
    for row, (prompt, answer) in enumerate(pairs):
        end = len(prompt) + len(answer)
        tokens[row, :end] = torch.tensor(prompt + answer)
        is_answer[row, len(prompt) : end] = True
    return TokenBatch(tokens, is_answer)


STATE: Final = "state.pt"
WEIGHTS: Final = "weights.pt"
_LOG = logging.getLogger(__name__)
_JUDGE_SEED: Final = 999


@dataclass(slots=True)
class Course:
    """Hold a training under way."""

    network: PlanDecoder
    optimizers: tuple[torch.optim.Optimizer, ...]
    settings: PlannerSettings
    spent_s: float = 0.0
    steps: int = 0

    @property
    def progress(self) -> float:
        """Return how much of the time is spent, from 0 to 1."""
        return min(1.0, self.spent_s / self.settings.budget_s)

    def state(self) -> dict[str, Any]:
        """Return what is needed to go on."""
        return {
            "network": self.network.state_dict(),
            "optimizers": [one.state_dict() for one in self.optimizers],
            "spent_s": self.spent_s,
            "steps": self.steps,
        }

    def resume(self, state: dict[str, Any]) -> None:
        """Go on from a state."""
        self.network.load_state_dict(state["network"])
        for one, saved in zip(self.optimizers, state["optimizers"], strict=True):
            one.load_state_dict(saved)
        self.spent_s, self.steps = state["spent_s"], state["steps"]


def train(
    out: Path,
    settings: PlannerSettings,
    chatter: tuple[str, ...] = (),
    start_from: Path | None = None,
) -> PlanDecoder:
    """Train until the time is spent, and write the weights; return the network.

    `start_from` is the folder of a finished training of the same shape, or one of fewer layers,
    whose weights and tokens this one begins with.
    """
    out.mkdir(parents=True, exist_ok=True)
    torch.manual_seed(settings.seed)
    network = PlanDecoder(settings.shape)
    if start_from is not None:
        earlier = torch.load(start_from / WEIGHTS, weights_only=True)
        network.load_state_dict(deepened(earlier, network.state_dict()))
        shutil.copyfile(start_from / TOKENIZER, out / TOKENIZER)
    tokenizer = tokenizer_in(out, chatter)
    course = Course(network, optimizers_of(network, settings), settings)
    if (out / STATE).exists():
        course.resume(torch.load(out / STATE, weights_only=True))
        _LOG.info("going on after %d steps, %.0f s", course.steps, course.spent_s)
    _run(course, tokenizer, Composer(chatter=chatter), out)
    torch.save(network.state_dict(), out / WEIGHTS)
    return network


def tokenizer_in(out: Path, chatter: tuple[str, ...]) -> Tokenizer:
    """Return the tokenizer of a training; the first time it is trained."""
    file = out / TOKENIZER
    if not file.exists():
        train_tokenizer(Composer(chatter=chatter)).save(str(file))
    return load_tokenizer(file)


def optimizers_of(
    network: PlanDecoder, settings: PlannerSettings
) -> tuple[torch.optim.Optimizer, ...]:
    """Return Muon for the matrices of the layers, and AdamW for the rest."""
    matrices = [one for one in network.layers.parameters() if one.dim() == 2]
    chosen = {id(one) for one in matrices}
    others = [one for one in network.parameters() if id(one) not in chosen]
    return (
        torch.optim.Muon(matrices, lr=settings.matrix_rate, weight_decay=settings.decay),
        torch.optim.AdamW(others, lr=settings.rate, betas=(0.9, 0.98), weight_decay=0.0),
    )


def _run(course: Course, tokenizer: Tokenizer, composer: Composer, out: Path) -> None:
    settings = course.settings
    random = Random(settings.seed + course.steps)
    peaks = (settings.matrix_rate, settings.rate)
    saved_s, began_s, losses = course.spent_s, time.monotonic() - course.spent_s, []
    for batch in batches(composer, tokenizer, random, settings.batch, settings.pool):
        for optimizer, peak in zip(course.optimizers, peaks, strict=True):
            optimizer.param_groups[0]["lr"] = peak * _factor(course)
        losses.append(_step(course, batch))
        course.steps += 1
        course.spent_s = time.monotonic() - began_s
        if course.spent_s - saved_s > settings.save_every_s:
            saved_s = course.spent_s
            _save(course, out)
            _tell(course, losses, tokenizer)
            losses = []
        if course.progress >= 1.0:
            break
    _save(course, out)
    _tell(course, losses or [math.nan], tokenizer)


def _factor(course: Course) -> float:
    """Return the share of the largest rate: a short rise, then a cosine down to nothing."""
    warm_up = course.settings.warm_up_ratio
    if course.progress < warm_up:
        return 0.05 + 0.95 * course.progress / warm_up
    return max(0.01, 0.5 + 0.5 * math.cos(math.pi * (course.progress - warm_up) / (1.0 - warm_up)))


def _step(course: Course, batch: TokenBatch) -> float:
    loss = loss_of(course.network, batch)
    for optimizer in course.optimizers:
        optimizer.zero_grad(set_to_none=True)
    loss.backward()  # type: ignore[no-untyped-call]
    nn.utils.clip_grad_norm_(course.network.parameters(), 1.0)
    for optimizer in course.optimizers:
        optimizer.step()
    return float(loss.detach())


def loss_of(network: PlanDecoder, batch: TokenBatch) -> Tensor:
    """Return the mean loss over the tokens of the answers."""
    scores, wanted = _answer_scores(network, batch)
    return functional.cross_entropy(scores, wanted)


def _answer_scores(network: PlanDecoder, batch: TokenBatch) -> tuple[Tensor, Tensor]:
    """Return scores where an answer's token comes next, and these tokens."""
    with torch.autocast("cpu", torch.bfloat16):
        values = network(batch.tokens[:, :-1])
        told = batch.is_answer[:, 1:]
        scores = network.scores(values[told])
    return scores.float(), batch.tokens[:, 1:][told]


@torch.no_grad()
def exact_ratio(
    network: PlanDecoder, tokenizer: Tokenizer, composer: Composer, count: int
) -> float:
    """Return the share of examples whose every token would be told right."""
    random = Random(_JUDGE_SEED)
    examples = [composer.example(random) for _ in range(count)]
    right = total = 0
    for batch in pool_batches(examples, tokenizer, random, min(64, count)):
        scores, wanted = _answer_scores(network, batch)
        rows = torch.nonzero(batch.is_answer[:, 1:])[:, 0]
        wrong = torch.zeros(len(batch.tokens)).index_add_(
            0, rows, (scores.argmax(-1) != wanted).float()
        )
        right += int((wrong == 0).sum())
        total += len(wrong)
    return right / total


def _save(course: Course, out: Path) -> None:
    draft = out / f"{STATE}.new"
    torch.save(course.state(), draft)
    draft.replace(out / STATE)


def _tell(course: Course, losses: list[float], tokenizer: Tokenizer) -> None:
    count = course.settings.judged
    seen = exact_ratio(course.network, tokenizer, Composer(), count)
    unseen = exact_ratio(course.network, tokenizer, Composer(held_out=True), count)
    _LOG.info(
        "%5.0f s, %6d steps, loss %.4f; exact %.3f, on phrases kept back %.3f",
        course.spent_s, course.steps, sum(losses) / len(losses), seen, unseen,
    )  # fmt: skip
