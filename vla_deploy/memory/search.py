"""Find episodes by their words and by vectors, and join both rankings."""

import re
import sqlite3
from collections import defaultdict
from collections.abc import Iterable, Sequence
from typing import Final

import numpy as np

from vla_deploy.memory.embedding import Embedder

# Each list counts 1 / (60 + rank): Cormack et al., "Reciprocal rank fusion", 2009.
_RANK_OFFSET: Final = 60.0
_CANDIDATES: Final = 24
# Texts that share fewer groups of letters are no more alike than any two.
LEAST_COSINE: Final = 0.25
_SMALL_WORDS: Final = (
    "a an the it its this that them my your me you i we is are was be to of in on at and or do "
    "please can could would will robot"
)
_EMPTY_WORDS: Final = frozenset(_SMALL_WORDS.split())


def search(
    connection: sqlite3.Connection, embedder: Embedder, text: str
) -> list[tuple[int, float]]:
    """Return numbers of episodes that fit a text, the best first, with their score."""
    scores: defaultdict[int, float] = defaultdict(float)
    for ranking in (_by_words(connection, text), _by_vectors(connection, embedder, text)):
        for rank, number in enumerate(ranking):
            scores[number] += 1.0 / (_RANK_OFFSET + rank)
    return sorted(scores.items(), key=lambda pair: (-pair[1], -pair[0]))


def _by_words(connection: sqlite3.Connection, text: str) -> list[int]:
    words = [word for word in re.findall(r"\w+", text.lower()) if word not in _EMPTY_WORDS]
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


def _by_vectors(connection: sqlite3.Connection, embedder: Embedder, text: str) -> list[int]:
    rows = connection.execute(
        "SELECT number, value FROM vector WHERE embedder = ? ORDER BY number", (embedder.name,)
    ).fetchall()
    if not rows:
        return []
    wanted = embedder.embed([_telling_words(text)])[0]
    known = np.frombuffer(b"".join(value for _, value in rows), dtype=np.float32)
    alike = known.reshape(len(rows), wanted.size) @ wanted
    best = np.argsort(-alike, kind="stable")[:_CANDIDATES]
    return [int(rows[row][0]) for row in best if alike[row] >= LEAST_COSINE]


def vectors_of(embedder: Embedder, texts: Sequence[str]) -> Iterable[bytes]:
    """Return the vectors of texts as they are stored."""
    rows = embedder.embed([_telling_words(text) for text in texts])
    return [row.astype(np.float32).tobytes() for row in rows]


def _telling_words(text: str) -> str:
    return " ".join(word for word in re.findall(r"\w+", text.lower()) if word not in _EMPTY_WORDS)
