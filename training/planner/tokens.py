"""Train the tokenizer: words and word parts, and each bracket of an answer as one token."""

import re
from collections.abc import Iterator
from itertools import islice
from pathlib import Path
from random import Random
from typing import Final

from tokenizers import AddedToken, Regex, Tokenizer
from tokenizers.decoders import ByteLevel as ByteLevelDecoder
from tokenizers.models import BPE
from tokenizers.pre_tokenizers import ByteLevel, Split
from tokenizers.pre_tokenizers import Sequence as InTurn
from tokenizers.trainers import BpeTrainer

from training.planner.sentences.composing import Composer
from vla_deploy.planning.command_parser.grammar import STEPS, field_names

VOCABULARY: Final = 2048
PAD, COMMAND, ANSWER, END = "<|pad|>", "<|command|>", "<|answer|>", "<|end|>"
SPECIAL: Final = (PAD, COMMAND, ANSWER, END)
_EXAMPLES: Final = 60_000
_SEED: Final = 20


def train_tokenizer(composer: Composer) -> Tokenizer:
    """Return a tokenizer trained on commands and answers."""
    tokenizer = Tokenizer(BPE())
    split = Split(Regex(_pattern()), behavior="isolated")
    tokenizer.pre_tokenizer = InTurn([split, ByteLevel(add_prefix_space=False, use_regex=False)])
    tokenizer.decoder = ByteLevelDecoder()
    trainer = BpeTrainer(
        vocab_size=VOCABULARY,
        special_tokens=[AddedToken(one, special=True) for one in SPECIAL],
        initial_alphabet=ByteLevel.alphabet(),
        show_progress=False,
    )
    tokenizer.train_from_iterator(islice(_texts(composer), 2 * _EXAMPLES), trainer)
    return tokenizer


def load_tokenizer(file: Path) -> Tokenizer:
    """Return a tokenizer that was saved."""
    return Tokenizer.from_file(str(file))


def prompt_of(command: str) -> str:
    """Return what the model is given for a command of plain words."""
    return f"{COMMAND} {command}{ANSWER}"


def _pattern() -> str:
    """Split off the brackets of answers, words with the space before them, and single digits."""
    fields = sorted({name for do in STEPS for name, _ in field_names(do)})
    brackets = ['{"steps":[{"do":"', '"},{"do":"', '"}]}', *(f'","{name}":"' for name in fields)]
    return "|".join([*map(re.escape, brackets), " ?[a-z_']+", " ?[0-9]", " ", "."])


def _texts(composer: Composer) -> Iterator[str]:
    random = Random(_SEED)
    while True:
        example = composer.example(random)
        yield " " + example.command
        yield example.answer
