"""Make batches of examples of about the same length, without end and always new."""

from collections.abc import Iterator
from dataclasses import dataclass
from random import Random

import torch
from tokenizers import Tokenizer
from torch import Tensor

from training.planner.composing import Composer, Example
from training.planner.tokens import END, PAD, prompt_of

# Longer ones are rare, and would make a batch of their own.
MOST_TOKENS = 112


@dataclass(frozen=True, slots=True)
class Batch:
    """Hold token numbers, batch x tokens, and which of them the model has to tell."""

    tokens: Tensor
    is_answer: Tensor


def batches(
    composer: Composer, tokenizer: Tokenizer, random: Random, size: int, pool: int
) -> Iterator[Batch]:
    """Yield batches without end."""
    while True:
        examples = [composer.example(random) for _ in range(pool)]
        yield from pool_batches(examples, tokenizer, random, size)


def pool_batches(
    examples: list[Example], tokenizer: Tokenizer, random: Random, size: int
) -> Iterator[Batch]:
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


def padded(pairs: list[tuple[list[int], list[int]]], pad: int) -> Batch:
    """Return a batch of prompts and answers, each padded behind."""
    longest = max(len(prompt) + len(answer) for prompt, answer in pairs)
    tokens = torch.full((len(pairs), longest), pad)
    is_answer = torch.zeros((len(pairs), longest), dtype=torch.bool)
    for row, (prompt, answer) in enumerate(pairs):
        end = len(prompt) + len(answer)
        tokens[row, :end] = torch.tensor(prompt + answer)
        is_answer[row, len(prompt) : end] = True
    return Batch(tokens, is_answer)
