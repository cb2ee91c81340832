"""Make batches of clips, spoilt and at times cut off, with what each state is to say."""

from collections import deque
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from training.speech.framing import IGNORED, draw_hop, framed, in_groups, padded
from training.speech.network import FRAMES_PER_STATE
from training.speech.spoiling import Spoiler
from training.stop_words.corpus import TRAIN, Clips, Said
from training.stop_words.texts import is_clean
from training.voices.clip import RATE_HZ, Wave
from training.voices.clip_store import read_shard, shards

BATCH_S: Final = 100.0
TALKERS: Final = 300
CUT_SHARE: Final = 0.3
"""Of clips that end while somebody still speaks, as phrases do that are read in a glance."""
SAID_FROM: Final = 0.5
"""Share of a word after which a state may tell it."""
SETTLED_S: Final = 0.08
"""How long after its end a state is to tell it still."""
UNSETTLED_S: Final = 0.2
"""How long around a word a state may say what it likes."""
ROUND: Final = 16_000
"""Clips that are drawn at a time."""
HARD: Final = 5000
"""As many of those that were taken for something else last come again with them."""
Random = np.random.Generator


@dataclass(frozen=True, slots=True, kw_only=True)
class Batch:
    """Hold frames (clip, mel, time) and the class that each state is to say, or IGNORED.

    `numbers` are those of the clips in their corpus.
    """

    frames: Tensor
    targets: Tensor
    numbers: tuple[int, ...]


class Talk:
    """Hold the clips of the recogniser's training in which no stop word is."""

    def __init__(self, folder: Path) -> None:
        """Open what `python -m training.speech data` has written."""
        clips = (clip for shard in shards(folder) for clip in read_shard(shard))
        self._clips = [clip for clip in clips if is_clean(clip.text)]

    def __len__(self) -> int:
        return len(self._clips)

    def __getitem__(self, number: int) -> Said:
        clip = self._clips[number]
        none = np.zeros((0, 3), np.float32)
        return Said(samples=clip.data, voice=clip.voice, events=none, phones=none[:, :2])


class Corpus:
    """Hold clips with and without stop words, and make batches of them."""

    def __init__(self, folder: Path, talk: Path | None, random: Random) -> None:
        """Open what `python -m training.stop_words speak` has written, and the recogniser's clips.

        Raises:
            FileNotFoundError: nothing was spoken yet.
        """
        self._random = random
        self._parts: list[Clips | Talk] = [
            *(Clips(folder, TRAIN, kind) for kind in ("stops", "others")),
            *([] if talk is None else [Talk(talk)]),
        ]
        self._places = [(part, n) for part in self._parts for n in range(len(part))]
        others = self._parts[1]
        talkers = [others[int(n)].wave for n in random.integers(len(others), size=TALKERS)]
        self._spoiler = Spoiler(talkers, random)
        self._hard: deque[int] = deque(maxlen=HARD)

    def __len__(self) -> int:
        return len(self._places)

    def remember(self, numbers: Sequence[int]) -> None:
        """Let these clips come again with the next round."""
        self._hard.extend(numbers)

    def batches(self) -> Iterator[Batch]:
        """Yield a round of clips, in groups of like length."""
        drawn = self._random.choice(len(self), min(ROUND, len(self)), replace=False)
        numbers = [*map(int, drawn), *self._hard]
        clips = [part[n] for part, n in (self._places[number] for number in numbers)]
        lengths_s = np.array([len(clip.samples) / RATE_HZ for clip in clips])
        for group in in_groups(lengths_s, BATCH_S, self._random):
            yield self._batch([clips[k] for k in group], tuple(numbers[k] for k in group))

    def _batch(self, clips: Sequence[Said], numbers: tuple[int, ...]) -> Batch:
        hop = draw_hop(self._random)
        waves, events = zip(*map(self._spoilt, clips), strict=True)
        made = padded(framed(waves, hop, self._random), self._random)
        count, state_s = made.shape[2] // FRAMES_PER_STATE, FRAMES_PER_STATE * hop / RATE_HZ
        targets = np.stack([_targets(each, count, state_s) for each in events])
        return Batch(frames=made, targets=torch.from_numpy(targets), numbers=numbers)

    def _spoilt(self, clip: Said) -> tuple[Wave, NDArray[np.float32]]:
        """Return one clip's sound, spoilt, and its words in seconds from its beginning."""
        random = self._random
        lead_s, tail_s = random.uniform(0.0, 0.5), random.uniform(0.0, 0.6)
        wave = self._spoiler.spoil(clip.wave, lead_s, tail_s, random)
        events = clip.events + np.array((0.0, lead_s, lead_s), np.float32)
        if random.random() < CUT_SHARE:
            first_s = float(events[-1, 2]) if len(events) else lead_s + 0.2
            wave = wave[: int(RATE_HZ * max(first_s, random.uniform(0.0, len(wave) / RATE_HZ)))]
        return np.ascontiguousarray(wave, np.float32), events


def _targets(events: NDArray[np.float32], count: int, state_s: float) -> NDArray[np.int64]:
    """Return the class of each state: that of a word in its later half and just behind it."""
    targets = np.zeros(count, np.int64)
    times_s = (np.arange(count) + 0.5) * state_s
    for _, start_s, end_s in events:
        around = (times_s > start_s - UNSETTLED_S / 2) & (times_s < end_s + UNSETTLED_S)
        targets[around & (targets == 0)] = IGNORED
    for number, start_s, end_s in events:
        said_s = start_s + SAID_FROM * (end_s - start_s)
        targets[(times_s >= said_s) & (times_s <= end_s + SETTLED_S)] = int(number)
    return targets
