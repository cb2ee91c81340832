"""Spot words on a stream: frames in, a smoothed score per word out, held against a threshold."""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from drivers.clock import NS_PER_S
from platforms import Profile
from vla_deploy.inference.errors import ModelMismatch
from vla_deploy.inference.manifest import KeyWords, Manifest
from vla_deploy.inference.roles import ModelShelf
from vla_deploy.inference.session import ModelSession
from vla_deploy.speech.sound import Sound, duration_ns
from vla_deploy.speech.stop_words import features

ROLE: Final = "key_words"


@dataclass(frozen=True, slots=True, kw_only=True)
class Spotted:
    """Hold that a word was heard: `stamp_ns` is the end of the sound that settled it."""

    word: str
    score: float
    stamp_ns: int


class Spotter:
    """Follow one stream of sound at 16 kHz; `score` is that of the likeliest word by now.

    `thresholds` tell from which score on a word was said, by how easily it is to be taken for said.
    """

    def __init__(self, session: ModelSession, manifest: Manifest) -> None:
        """Take the model and what its manifest says of it.

        Raises:
            ModelMismatch: it wants other features than there are, or none at all.
        """
        self._session = session
        key_words = _checked(manifest)
        self.words, self.thresholds = key_words.words, key_words.thresholds
        self._smoothing_frames = key_words.smoothing_frames
        self._input = manifest.inputs[0].name
        self._output = manifest.outputs[0].name
        self._held_frames = int(manifest.inputs[0].shape[2])
        self._moments = int(manifest.outputs[0].shape[2])
        self._step = self._moments * features.STRIDE
        self.runs = 0
        self._refractory_ns = round(key_words.refractory_s * NS_PER_S)
        self.reset()

    def reset(self) -> None:
        """Begin anew: what follows has nothing to do with what was heard."""
        self._stream = features.LogMelStream()
        self._frames = features.silence(self._held_frames)
        self._fresh = np.zeros((0, features.BANDS), np.float32)
        self._scores = np.zeros((0, len(self.words)), np.float32)
        self._quiet_until_ns = 0
        self.score = 0.0

    def feed(self, sound: Sound, end_ns: int, threshold: float) -> Spotted | None:
        """Take the next piece of sound, whose last sample was at `end_ns`; tell what was said.

        Raises:
            RunFailed: the model fails; the sound is lost to it.
        """
        self._fresh = np.concatenate([self._fresh, self._stream.feed(sound)])
        spotted: Spotted | None = None
        while len(self._fresh) >= self._step:
            new, self._fresh = self._fresh[: self._step], self._fresh[self._step :]
            behind = len(self._fresh) * features.HOP + self._stream.waiting
            found = self._judge(new, end_ns - duration_ns(behind), threshold)
            spotted = spotted or found
        return spotted

    def _judge(self, new: features.Frames, stamp_ns: int, threshold: float) -> Spotted | None:
        self._frames = np.concatenate([self._frames[len(new) :], new])
        outputs = self._session.run({self._input: self._frames.T[None]})
        self.runs += 1
        scores = outputs[self._output][0, 1:].T
        kept = self._smoothing_frames - 1 + self._moments
        self._scores = np.concatenate([self._scores, scores])[-kept:]
        best = _smoothed(self._scores, self._smoothing_frames)
        number = int(best.argmax())
        self.score = float(best[number])
        if best[number] < threshold or stamp_ns < self._quiet_until_ns:
            return None
        self._quiet_until_ns = stamp_ns + self._refractory_ns
        return Spotted(word=self.words[number], score=float(best[number]), stamp_ns=stamp_ns)


def _smoothed(scores: NDArray[np.float32], count: int) -> NDArray[np.float32]:
    """Return each word's best mean over `count` moments; those before the first count as 0."""
    padded = np.concatenate([np.zeros((count - 1, scores.shape[1]), np.float32), scores])
    windows = np.lib.stride_tricks.sliding_window_view(padded, count, axis=0)
    best: NDArray[np.float32] = windows.mean(axis=2, dtype=np.float32).max(axis=0)
    return best


def _checked(manifest: Manifest) -> KeyWords:
    words, shapes = manifest.key_words, [one.shape for one in (*manifest.inputs, *manifest.outputs)]
    is_counted = all(isinstance(shape[-1], int) for shape in shapes)
    fits = is_counted and len(shapes) == 2 and shapes[0][:2] == (1, features.BANDS)
    if words is None or words.features != features.NAME or not fits:
        got = "no [key_words]" if words is None else f"features {words.features!r}"
        fault = (
            f"expected features {features.NAME!r}, one input of shape (1, {features.BANDS}, "
            f"frames) and a count of moments, got {got} and {shapes}"
        )
        raise ModelMismatch(manifest.name, (fault,))
    return words


def open_spotter(shelf: ModelShelf, profile: Profile) -> Spotter:
    """Open the network that a profile chooses.

    Raises:
        InferenceError: the profile's model cannot be opened, or a spotter cannot run it.
    """
    session = shelf.open(ROLE, profile, 0)
    return Spotter(session, session.model.manifest)
