"""Turn texts into vectors whose cosine tells how alike the texts are."""

import re
import zlib
from collections.abc import Sequence
from typing import Final, Protocol

import numpy as np
from numpy.typing import NDArray

Vectors = NDArray[np.float32]


class Embedder(Protocol):
    """Turn texts into vectors; vectors of different names are never compared."""

    @property
    def name(self) -> str:
        """Return what tells this kind of vector from others."""
        ...

    def embed(self, texts: Sequence[str]) -> Vectors:
        """Return one row of length 1 per text, or of zeros for a text without words."""
        ...


class LetterGroups:
    """Compare texts by the groups of letters in their words: the embedded default, no model.

    It finds what full text misses by spelling ("botle", "teapots"), not what means the same in
    other words. Each group of three to five letters falls on one of the dimensions with a sign
    (Weinberger et al., "Feature hashing for large scale multitask learning", 2009).
    """

    name: Final = "letter-groups-256"
    _DIMENSIONS: Final = 256
    _LENGTHS: Final = (3, 4, 5)

    def embed(self, texts: Sequence[str]) -> Vectors:
        """Return one row of length 1 per text, or of zeros for a text without words."""
        rows = np.zeros((len(texts), self._DIMENSIONS), dtype=np.float32)
        for row, text in zip(rows, texts, strict=True):
            for word in re.findall(r"\w+", text.lower()):
                self._add(row, f"<{word}>")
        lengths = np.linalg.norm(rows, axis=1, keepdims=True)
        unit: Vectors = np.divide(rows, lengths, out=rows, where=lengths > 0.0)
        return unit

    def _add(self, row: Vectors, word: str) -> None:
        for length in self._LENGTHS:
            for start in range(max(1, len(word) - length + 1)):
                code = zlib.crc32(word[start : start + length].encode())
                row[code % self._DIMENSIONS] += 1.0 if code & 0x8000_0000 else -1.0
