"""Find episodes by their words and by vectors, and join all rankings.

One kind of vectors is always there: `LetterGroups`, which find what full text misses by spelling
("botle", "teapots"). Another comes with a text embedder that a person has installed: its vectors
find what means the same in other words.
"""

import re
import sqlite3
import zlib
from collections import defaultdict
from collections.abc import Mapping, Sequence
from typing import Final, Protocol

import numpy as np
from numpy.typing import NDArray

Vectors = NDArray[np.float32]

_DIMENSIONS: Final = 256
_LENGTHS: Final = (3, 4, 5)
# Each list counts 1 / (60 + rank): Cormack et al., "Reciprocal rank fusion", 2009.
_RANK_OFFSET: Final = 60.0
_CANDIDATES: Final = 24
# A ranking by meaning counts for more than words and letters together, which err together.
_MEANING: Final = 3.0
_SMALL_WORDS: Final = (
    "a an the it its this that them my your me you i we is are was be to of in on at and or do "
    "please could would will robot"
)
_EMPTY_WORDS: Final = frozenset(_SMALL_WORDS.split())


class Embedder(Protocol):
    """Make vectors of texts, whose cosine says how alike the texts are.

    Vectors are kept by the `name` of their maker: those of different names are never compared. Two
    texts whose cosine is below `least_cosine` have nothing in common.
    """

    name: str
    least_cosine: float

    def embed(self, texts: Sequence[str]) -> Vectors:
        """Return one row of length 1 per text, or of zeros for a text that says nothing.

        Raises:
            InferenceError: a model of it cannot run.
        """
        ...


class LetterGroups:
    """Embed texts by the groups of letters in their words; it needs no model.

    Each group of three to five letters falls on one of the dimensions with a sign (Weinberger et
    al., "Feature hashing for large scale multitask learning", 2009).
    """

    name = "letter-groups-256"
    least_cosine = 0.25  # with fewer groups in common, texts are no more alike than any two

    def embed(self, texts: Sequence[str]) -> Vectors:
        """Return one row per text, of zeros where its words all say nothing."""
        rows = np.zeros((len(texts), _DIMENSIONS), dtype=np.float32)
        for row, text in zip(rows, texts, strict=True):
            for word in _significant_words(text):
                _add_letter_groups(row, f"<{word}>")
        lengths = np.linalg.norm(rows, axis=1, keepdims=True)
        unit: Vectors = np.divide(rows, lengths, out=rows, where=lengths > 0.0)
        return unit


def search(
    connection: sqlite3.Connection, text: str, asked: Mapping[str, tuple[Vectors, float]]
) -> list[tuple[int, float]]:
    """Return numbers of episodes that fit a text, the best first, with their score.

    `asked` has the text's vector and the least cosine, by the name of each embedder.
    """
    scores: defaultdict[int, float] = defaultdict(float)
    rankings = [(1.0, _by_words(connection, text))]
    for name, wanted in asked.items():
        weight = 1.0 if name == LetterGroups.name else _MEANING
        rankings.append((weight, _by_vectors(connection, name, *wanted)))
    for weight, ranking in rankings:
        for rank, number in enumerate(ranking):
            scores[number] += weight / (_RANK_OFFSET + rank)
    return sorted(scores.items(), key=lambda pair: (-pair[1], -pair[0]))


def _by_words(connection: sqlite3.Connection, text: str) -> list[int]:
    words = _significant_words(text)
    if not words:
        return []
    # Each word in quotes: what a person says is no query language.
    question = " OR ".join(f'"{word}"' for word in dict.fromkeys(words))
    rows = connection.execute(
        "SELECT rowid FROM episode_text WHERE episode_text MATCH ? "
        "ORDER BY bm25(episode_text), rowid DESC LIMIT ?",
        (question, _CANDIDATES),
    )
    return [number for (number,) in rows]


def _by_vectors(
    connection: sqlite3.Connection, name: str, wanted: Vectors, least_cosine: float
) -> list[int]:
    rows = connection.execute(
        "SELECT number, value FROM vector WHERE embedder = ? ORDER BY number", (name,)
    ).fetchall()
    if not rows:
        return []
    known = np.frombuffer(b"".join(value for _, value in rows), dtype=np.float32)
    alike = known.reshape(len(rows), wanted.size) @ wanted
    best = np.argsort(-alike, kind="stable")[:_CANDIDATES]
    return [int(rows[row][0]) for row in best if alike[row] >= least_cosine]


def _add_letter_groups(row: Vectors, word: str) -> None:
    for length in _LENGTHS:
        for start in range(max(1, len(word) - length + 1)):
            code = zlib.crc32(word[start : start + length].encode())
            row[code % _DIMENSIONS] += 1.0 if code & 0x8000_0000 else -1.0


def _significant_words(text: str) -> list[str]:
    return [word for word in re.findall(r"\w+", text.lower()) if word not in _EMPTY_WORDS]
