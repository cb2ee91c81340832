"""Tell by what a recogniser's encoder makes of a phrase how surely a stop word is in it.

The decoder writes the words that are likeliest as a whole, and in noise makes "hold it" of a
"halt". This head looks for the stop words alone, in the very states that the decoder reads, which
have been computed anyway. `training/stop_head` makes it for the recogniser that is shipped;
another Whisper has none.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final
from zipfile import BadZipFile

import numpy as np
from numpy.typing import NDArray

from vla_deploy.inference.errors import ModelFileSpoiled
from vla_deploy.inference.store import Model

FILE: Final = "stop_head.npz"
TENSORS: Final = ("near.weight", "near.bias", "far.weight", "far.bias", "last.weight", "last.bias")
SETTLING: Final = 2
"""So many states in a row tell a word, 40 ms each: one alone may be chance."""
Array = NDArray[np.float32]


class StopHead:
    """Hold two convolutions over time and a layer that names the words; output 0 is none."""

    def __init__(self, weights: dict[str, Array]) -> None:
        """Take tensors by their names in `TENSORS`; a convolution's are (out, in, time)."""
        self._layers = [_Layer.of(weights, name) for name in ("near", "far")]
        self._last, self._last_bias = weights["last.weight"].T, weights["last.bias"]

    def surety(self, states: Array) -> float:
        """Return how surely one of the words is in states (time, width): from 0 to 1."""
        if len(states) < SETTLING:
            return 0.0
        x = states
        for layer in self._layers:
            x = layer.run(x)
        logits = x @ self._last + self._last_bias
        logits -= logits.max(axis=1, keepdims=True)
        chances = np.exp(logits)
        chances /= chances.sum(axis=1, keepdims=True)
        runs = np.lib.stride_tricks.sliding_window_view(chances[:, 1:], SETTLING, axis=0)
        return float(runs.mean(axis=2).max())


@dataclass(frozen=True, slots=True, eq=False)
class _Layer:
    """Hold a convolution over time, (time, in, out), and what is added."""

    taps: Array
    bias: Array

    @classmethod
    def of(cls, weights: dict[str, Array], name: str) -> "_Layer":
        taps = np.ascontiguousarray(weights[f"{name}.weight"].transpose(2, 1, 0))
        return cls(taps, weights[f"{name}.bias"])

    def run(self, x: Array) -> Array:
        """Return what becomes of (time, in), as long as it was, cut off below nought."""
        half = len(self.taps) // 2
        padded = np.pad(x, ((half, half), (0, 0)))
        parts = [padded[k : k + len(x)] @ tap for k, tap in enumerate(self.taps)]
        out: Array = np.maximum(0.0, np.sum(parts, axis=0) + self.bias)
        return out


def open_stop_head(model: Model) -> StopHead | None:
    """Return the head of a recogniser, None where it has none.

    Raises:
        ModelFileSpoiled: the file is no such head.
    """
    if all(part.path != FILE for part in model.manifest.parts):
        return None
    path = model.folder / FILE
    try:
        return StopHead(_read(path))
    except (OSError, ValueError, KeyError, IndexError, EOFError, BadZipFile) as error:
        raise ModelFileSpoiled(
            f"{path}: no head for stop words: {error}; expected {', '.join(TENSORS)} as "
            "`python -m training.stop_head` writes them"
        ) from error


def _read(path: Path) -> dict[str, Array]:
    """Return the tensors of a file, which must fit one another."""
    with path.open("rb") as file:
        stored: Any = np.load(file, allow_pickle=False)
        weights = {name: np.ascontiguousarray(stored[name], np.float32) for name in TENSORS}
    shapes = {name: values.shape for name, values in weights.items()}
    near, far, last = (shapes[f"{name}.weight"] for name in ("near", "far", "last"))
    fit = (
        len(near) == len(far) == 3
        and len(last) == 2
        and (near[0], far[0]) == (far[1], last[1])
        and near[2] % 2 == far[2] % 2 == 1
        and [shapes[f"{name}.bias"] for name in ("near", "far", "last")]
        == [(near[0],), (far[0],), (last[0],)]
    )
    if not fit:
        raise ValueError(f"shapes {shapes} do not fit one another")
    return weights
