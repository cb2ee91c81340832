"""Bring a command to the plain words that the command parser has learnt to read."""

import re
import unicodedata
from collections.abc import Sequence
from typing import Final

# More than a person says in a breath; longer texts are no commands.
MOST_COMMAND_WORDS: Final = 60
_WORD: Final = re.compile(r"\d+(?:\.\d+)?|[a-z_]+\d+|[a-z]+(?:'[a-z]+)*")
_ASKS: Final = frozenset(
    {"am", "can", "could", "did", "do", "may", "might", "must", "shall", "should", "will", "would"}
)
_SIGNS: Final = {"°": " degrees ", "’": "'", "´": "'", "`": "'", "%": " percent ", "½": " half "}


def plain_words(text: str) -> list[str]:
    """Return the words of a text in lower case: Latin letters, digits, apostrophes, underscores."""
    for sign, words in _SIGNS.items():
        text = text.replace(sign, words)
    decomposed = unicodedata.normalize("NFKD", text.lower())
    bare = "".join(one for one in decomposed if not unicodedata.combining(one))
    return _WORD.findall(bare)


def asks_about_speaker(words: Sequence[str]) -> bool:
    """Tell whether words ask what their speaker may, shall or does: "can I stay up longer"."""
    return len(words) > 1 and words[0] in _ASKS and words[1] == "i"


def foreign_share(text: str) -> float:
    """Return the share of a text's letters that are not Latin."""
    letters = [one for one in unicodedata.normalize("NFKD", text) if one.isalpha()]
    foreign = [one for one in letters if not one.isascii()]
    return len(foreign) / len(letters) if letters else 0.0
