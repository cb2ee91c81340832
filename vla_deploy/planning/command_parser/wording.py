"""Bring a command to the plain words that the parser reads, and find in it what was copied."""

import re
import unicodedata
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

from vla_deploy.planning.command_parser.grammar import COPIED_FIELDS, Step
from vla_deploy.world.vocabulary import ARTICLES

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
    """Return whether words ask what their speaker may, shall or does: "can I stay up longer"."""
    return len(words) > 1 and words[0] in _ASKS and words[1] == "i"


def foreign_share(text: str) -> float:
    """Return the share of a text's letters that are not Latin."""
    letters = [one for one in unicodedata.normalize("NFKD", text) if one.isalpha()]
    foreign = [one for one in letters if not one.isascii()]
    return len(foreign) / len(letters) if letters else 0.0


# --- where the words of a field were copied from -------------------------------------------------

# Said between the words of one expression, they change nothing; the articles tell how many.
SILENT: Final = frozenset(
    {
        *ARTICLES, "is", "are", "which", "that's", "of", "his", "her", "their", "its", "these",
        "those", "uh", "um", "er", "erm", "hmm", "uhm", "mm", "ah", "eh", "well", "like", "you",
        "know", "so", "okay", "lying", "sitting", "standing", "located", "placed", "stands", "lies",
        "over", "there", "see",
    }
)  # fmt: skip
_KEPT: Final = frozenset({*ARTICLES, "of", "his", "her"})


@dataclass(frozen=True, slots=True, kw_only=True)
class Span:
    """Hold where words stand, in order; `spoken` are they with the articles said among them.

    `jumps` counts the words passed over that do mean something: copied like that, they may belong
    to different things.
    """

    places: tuple[int, ...]
    spoken: tuple[str, ...]
    jumps: int


def copied_spans(
    steps: Sequence[Step], command: Sequence[str]
) -> Iterator[tuple[str, Span | None]]:
    """Yield what each field of the steps holds that is copied, and where in the command it is."""
    for step in steps:
        for field in COPIED_FIELDS & step.keys():
            yield step[field], find_span(step[field].split(), command)


def find_span(words: Sequence[str], command: Sequence[str]) -> Span | None:
    """Return the tightest place of words in a command in their order, None where they are not."""
    ends = [at for at, word in enumerate(command) if words and word == words[-1]]
    found = [span for end in ends if (span := _ending_at(words, command, end)) is not None]
    return min(found, key=lambda span: (span.jumps, len(span.places)), default=None)


def _ending_at(words: Sequence[str], command: Sequence[str], end: int) -> Span | None:
    places = [end]
    for word in reversed(words[:-1]):
        before = [at for at in range(places[0]) if command[at] == word]
        if not before:
            return None
        places.insert(0, before[-1])
    passed = [command[at] for at in range(places[0], end) if at not in places]
    return Span(
        places=tuple(places),
        spoken=tuple(_spoken(places, command)),
        jumps=sum(word not in SILENT for word in passed),
    )


def _spoken(places: list[int], command: Sequence[str]) -> list[str]:
    first = places[0]
    while first > 0 and command[first - 1] in _KEPT:
        first -= 1
    return [
        command[at] for at in range(first, places[-1] + 1) if at in places or command[at] in _KEPT
    ]
