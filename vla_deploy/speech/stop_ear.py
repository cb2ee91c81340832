"""Tell how surely a stop word is in a phrase, whatever the recogniser reads.

A decoder writes the words that are likeliest as a whole, and in noise makes "hold it" of a "halt".
This network listens for the stop words alone; it may be several of one kind, side by side, whose
mean is told. It began as a copy of the recogniser's encoder, and hears frames of the same kind, of
a phrase and a moment before it: where a phrase begins is only the guess of the voice network.
`training/stop_ear` makes it for the recogniser that is shipped, another Whisper has none.
"""

from collections.abc import Callable, Iterator
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from vla_deploy.inference.errors import ModelFileSpoiled
from vla_deploy.inference.graph_session import GraphSession
from vla_deploy.inference.opening import PLAIN_CHOICE
from vla_deploy.inference.store import Model
from vla_deploy.speech.sound import RATE_HZ, Sound, count_of

FILE: Final = "stop_ear.onnx"
FRAMES, SCORES = "frames", "scores"
SETTLING: Final = 2
"""So many scores in a row tell a word, 40 ms each: one alone may be chance."""
HEARD_AGAIN_FROM: Final = 0.02
"""From that surety on a phrase is heard again: what is only chance seldom stays."""
STATE_S: Final = 0.04
"""Each score is for so much sound."""
LONGEST_S: Final = 27.0
"""Spoken slower it still fits into the network's 32 s; what was said first is left out."""
LATER_S: Final = 0.03
PACES: Final = (0.91, 1.09)
"""As what it is heard again: as if it had begun so much later, or was spoken so fast."""
_RANK: Final = 3
Array = NDArray[np.float32]
FramesOf = Callable[[Sound], Array]


class StopEar:
    """Hold a graph that gives each 40 ms of a phrase a score for no word and for each of them."""

    def __init__(self, graph: GraphSession) -> None:
        """Take an open graph of frames (1, mel, frame) to scores (1, time, class).

        Raises:
            ModelFileSpoiled: it is no such graph.
        """
        given = {one.name: len(one.shape) for one in (*graph.inputs, *graph.outputs)}
        if given != {FRAMES: _RANK, SCORES: _RANK}:
            raise ModelFileSpoiled(
                f"{graph.path}: no ear for stop words: it has {given}; expected {FRAMES} and "
                f"{SCORES} of {_RANK} dimensions, as `python -m training.stop_ear` writes them"
            )
        self._graph = graph

    def surety(self, frames: NDArray[Any], from_s: float = 0.0) -> float:
        """Return how surely one of the words is in frames (mel, frame): from 0 to 1.

        One that was said before `from_s` does not count.

        Raises:
            RunFailed: the frames are not of as many mel bands as it was made for.
        """
        given = np.ascontiguousarray(frames[np.newaxis], np.float32)
        scores: Array = self._graph.run([SCORES], {FRAMES: given})[SCORES][0]
        scores = scores[round(from_s / STATE_S) :]
        if len(scores) < SETTLING:
            return 0.0
        runs = np.lib.stride_tricks.sliding_window_view(scores[:, 1:], SETTLING, axis=0)
        return float(runs.mean(axis=2).max())

    def surety_of(self, sound: Sound, earlier: Sound, frames_of: FramesOf) -> float:
        """Return the mean surety of a phrase as it is and as it might as well have been spoken.

        It is heard together with what was `earlier`, just before. `frames_of` returns what the
        recogniser would be given of sound.

        Raises:
            RunFailed: the frames are not of as many mel bands as it was made for.
        """
        whole = np.concatenate((earlier, sound))[-count_of(LONGEST_S) :]
        from_s = max(0, len(whole) - len(sound)) / RATE_HZ
        first = self.surety(frames_of(whole), from_s)
        if first < HEARD_AGAIN_FROM:
            return first
        again = [self.surety(frames_of(one), at_s) for one, at_s in _varied(whole, from_s)]
        return float(np.mean([first, *again]))

    def close(self) -> None:
        """Release the memory."""
        self._graph.close()


def _varied(sound: Sound, from_s: float) -> Iterator[tuple[Sound, float]]:
    """Yield sound a moment later, slower and faster, and where its phrase begins."""
    yield np.pad(sound, (round(RATE_HZ * LATER_S), 0)), from_s + LATER_S
    for pace in PACES:
        times = np.arange(0.0, len(sound) - 1.0, pace)
        spoken = np.interp(times, np.arange(len(sound)), sound).astype(np.float32)
        yield spoken, from_s / pace


def open_stop_ear(model: Model) -> StopEar | None:
    """Return the ear of a recogniser, None where it has none.

    Raises:
        ModelFileSpoiled: the file is no such ear.
    """
    if all(part.path != FILE for part in model.manifest.parts):
        return None
    return StopEar(GraphSession(model.folder / FILE, PLAIN_CHOICE))
