"""Begin a training where a shipped recogniser ended: read CTranslate2's file back into weights.

The file is CTranslate2's, version 6 (`python/ctranslate2/specs/model_spec.py`): named arrays, eight
bits a weight with a scale per row. What eight bits have lost is soon learnt again.
"""

import struct
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float32]
VERSION: Final = 6
_TYPES: Final = (np.float32, np.int8, np.int16, np.int32, np.float16)
_NORMS: Final = {"gamma": "weight", "beta": "bias"}
# Of each part of a layer: how it is called in Whisper, and which matrices lie one upon another.
_SELF: Final = {"linear_0": ("q_proj", "k_proj", "v_proj"), "linear_1": ("out_proj",)}
_ACROSS: Final = {
    "linear_0": ("q_proj",), "linear_1": ("k_proj", "v_proj"), "linear_2": ("out_proj",)
}  # fmt: skip
_PARTS: Final = {
    "self_attention": ("self_attn.", "self_attn_layer_norm", _SELF),
    "attention": ("encoder_attn.", "encoder_attn_layer_norm", _ACROSS),
    "ffn": ("", "final_layer_norm", {"linear_0": ("fc1",), "linear_1": ("fc2",)}),
}
_TABLES: Final = {
    "embeddings/weight": "embed_tokens",
    "position_encodings/encodings": "embed_positions",
}


class NotReadable(ValueError):
    """Say why a file gives no weights."""


def weights_of(path: Path) -> dict[str, Array]:
    """Return the weights of a `model.bin` by the names that the training gives them.

    Raises:
        NotReadable: it is no such file, or it is cut off.
        OSError: it cannot be read.
    """
    try:
        stored = _variables(path.read_bytes())
    except (struct.error, UnicodeDecodeError, ValueError, IndexError) as error:
        raise NotReadable(f"{path}: expected CTranslate2's version {VERSION}: {error}") from error
    weights: dict[str, Array] = {}
    for name, values in stored.items():
        scale = stored.get(f"{name}_scale")
        if values.ndim == 0 or name.endswith("_scale"):
            continue
        rows = values.astype(np.float32)
        if scale is not None:
            rows /= scale.reshape(-1, *[1] * (rows.ndim - 1))
        weights |= _named(name, rows)
    return weights


def widened(weights: dict[str, Array], seed: int) -> dict[str, Array]:
    """Return the weights of a network twice as wide, with twice the heads, that tells the same.

    Every value in it is there twice. How much of each sum comes from either of the two is drawn by
    chance, so that learning can part them (Chen et al., Net2Net, 2016).
    """
    random = np.random.default_rng([seed, 8])
    wide = {name: _wider(name, values, random) for name, values in weights.items()}
    # The words' table gives the output too, in which each value would count twice.
    for kind in ("weight", "bias"):
        wide[f"decoder.layer_norm.{kind}"] /= 2.0
    return wide


def _wider(name: str, values: Array, random: np.random.Generator) -> Array:
    if "embed_" in name:
        return np.concatenate([values, values], axis=1)
    doubled = np.concatenate([values, values], axis=0)
    if values.ndim == 1 or name == "encoder.conv1.weight":
        return doubled
    share = random.uniform(0.25, 0.75, doubled.shape).astype(np.float32)
    return np.concatenate([doubled * share, doubled * (1.0 - share)], axis=1)


def _named(name: str, rows: Array) -> dict[str, Array]:
    """Return one stored array by Whisper's names; of what lies one upon another each part."""
    half, _, rest = name.partition("/")
    words = rest.split("/")
    if words[0].startswith("layer_") and words[0] != "layer_norm":
        place, part, which, kind = f"{half}.layers.{words[0][6:]}.", words[1], words[2], words[3]
        prefix, norm, matrices = _PARTS[part]
        if which == "layer_norm":
            return {f"{place}{norm}.{_NORMS[kind]}": rows}
        owners = matrices[which]
        pieces = np.split(rows, len(owners))
        found = zip(owners, pieces, strict=True)
        # Whisper's keys have no bias: what is stored for it is nothing but zeros.
        return {
            f"{place}{prefix}{owner}.{kind}": piece
            for owner, piece in found
            if (owner, kind) != ("k_proj", "bias")
        }
    if words[0] == "layer_norm":
        return {f"{half}.layer_norm.{_NORMS[words[1]]}": rows}
    if rest in _TABLES:
        return {f"{half}.{_TABLES[rest]}.weight": rows}
    return {f"{half}.{'.'.join(words)}": rows}


def _variables(data: bytes) -> dict[str, NDArray[np.generic]]:
    reader = _Reader(data)
    version = reader.number("I")
    if version != VERSION:
        raise ValueError(f"it is of version {version}")
    reader.text()
    reader.number("I")
    return dict(reader.variable() for _ in range(reader.number("I")))


class _Reader:
    """Take one value after another."""

    def __init__(self, data: bytes) -> None:
        self._data = data
        self._place = 0

    def number(self, kind: str) -> int:
        """Return a whole number; `kind` is a format of `struct`."""
        (value,) = struct.unpack_from(f"<{kind}", self._data, self._place)
        self._place += struct.calcsize(kind)
        return int(value)

    def text(self) -> str:
        """Return a text that ends with a zero."""
        length = self.number("H")
        value = self._data[self._place : self._place + length - 1].decode()
        self._place += length
        return value

    def variable(self) -> tuple[str, NDArray[np.generic]]:
        """Return a name and its array."""
        name = self.text()
        shape = [self.number("I") for _ in range(self.number("B"))]
        kind = np.dtype(_TYPES[self.number("B")])
        size = self.number("I")
        values = np.frombuffer(self._data, kind, size // kind.itemsize, self._place)
        self._place += size
        return name, values.reshape(shape)
