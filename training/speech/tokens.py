"""Make the tokens: pieces of words, then Whisper's own marks in the order that it expects."""

import json
from collections.abc import Iterable
from pathlib import Path
from typing import Any, Final

from tokenizers import AddedToken, Tokenizer, decoders, models, pre_tokenizers, trainers

TOKENIZER: Final = "tokenizer.json"
END, START, NO_SPEECH, BARE = (
    "<|endoftext|>", "<|startoftranscript|>", "<|nospeech|>", "<|notimestamps|>",
)  # fmt: skip
PREVIOUS: Final = "<|startofprev|>"
MARKS: Final = (
    END, START, "<|en|>", "<|translate|>", "<|transcribe|>", "<|startoflm|>", PREVIOUS, NO_SPEECH,
    BARE,
)  # fmt: skip
# One each 20 ms of half a minute; they come last, as whoever reads Whisper expects.
TIMES: Final = tuple(f"<|{number * 0.02:.2f}|>" for number in range(1501))


def make_tokenizer(texts: Iterable[str], text_tokens: int) -> Tokenizer:
    """Learn pieces of words from texts: byte-level, so that every text has tokens."""
    tokenizer = Tokenizer(models.BPE())
    tokenizer.pre_tokenizer = pre_tokenizers.ByteLevel(add_prefix_space=False)
    tokenizer.decoder = decoders.ByteLevel()
    trainer = trainers.BpeTrainer(
        vocab_size=text_tokens,
        initial_alphabet=pre_tokenizers.ByteLevel.alphabet(),
        show_progress=False,
    )
    tokenizer.train_from_iterator((f" {text}" for text in texts), trainer)
    tokenizer.add_special_tokens([AddedToken(mark, special=True) for mark in (*MARKS, *TIMES)])
    return tokenizer


class Coder:
    """Turn texts into the token numbers that the decoder learns."""

    def __init__(self, tokenizer: Tokenizer) -> None:
        self._tokenizer = tokenizer
        self.count = tokenizer.get_vocab_size()
        numbers: dict[str, Any] = {mark: tokenizer.token_to_id(mark) for mark in MARKS}
        self.end, self.start = numbers[END], numbers[START]
        self.previous, self.no_speech, self.bare = (
            numbers[PREVIOUS], numbers[NO_SPEECH], numbers[BARE],
        )  # fmt: skip

    def text(self, text: str) -> list[int]:
        """Return the tokens of a text, a space before it as Whisper has it."""
        numbers: list[int] = self._tokenizer.encode(f" {text}", add_special_tokens=False).ids
        return numbers

    @classmethod
    def load(cls, path: Path) -> "Coder":
        """Read a tokenizer."""
        return cls(Tokenizer.from_file(str(path)))


def settings() -> str:
    """Return what the tokenizer's reader must know of it, as JSON."""
    kind = {"tokenizer_class": "PreTrainedTokenizerFast", "eos_token": END, "bos_token": END}
    return json.dumps(kind)
