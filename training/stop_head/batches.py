"""Make batches of clips, spoilt and at times cut off, with what each state is to say."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from training.speech.features import HOP, WARPS, frames
from training.speech.network import FRAMES_PER_STATE, MELS
from training.speech.spoiling import Spoiler, draw_gains
from training.stop_words.corpus import TRAIN, Clips, Said
from training.stop_words.texts import is_clean
from training.voices.clip import RATE_HZ
from training.voices.clip_store import read_shard, shards

IGNORED: Final = -100
BATCH_S: Final = 100.0
TALKERS: Final = 300
CUT_SHARE: Final = 0.3
"""Of clips that end while somebody still speaks, as phrases do that are read in a glance."""
OTHER_PACE_SHARE: Final = 0.5
SAID_FROM: Final = 0.5
"""Share of a word after which a state may tell it."""
SETTLED_S: Final = 0.08
"""How long after its end a state is to tell it still."""
UNSETTLED_S: Final = 0.2
"""How long around a word a state may say what it likes."""
PADDING_FRAMES: Final = (20, 60)
Random = np.random.Generator


@dataclass(frozen=True, slots=True, kw_only=True)
class Batch:
    """Hold frames (clip, mel, time) and the class that each state is to say, or IGNORED."""

    frames: Tensor
    targets: Tensor


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
        talk = [_wave(others[int(n)]) for n in random.integers(len(others), size=TALKERS)]
        self._spoiler = Spoiler(talk, random)

    def __len__(self) -> int:
        return len(self._places)

    def batches(self) -> Iterator[Batch]:
        """Yield all clips once, in groups of like length."""
        lengths_s = np.array([len(part[n].samples) / RATE_HZ for part, n in self._places])
        order = np.argsort(lengths_s * self._random.uniform(0.9, 1.1, len(lengths_s)))
        groups: list[list[int]] = [[]]
        for number in order:
            longest_s = lengths_s[number] + 1.2
            if groups[-1] and longest_s * (len(groups[-1]) + 1) > BATCH_S:
                groups.append([])
            groups[-1].append(int(number))
        for place in self._random.permutation(len(groups)):
            clips = [part[n] for part, n in (self._places[number] for number in groups[place])]
            yield self._batch(clips)

    def _batch(self, clips: Sequence[Said]) -> Batch:
        random = self._random
        other_pace = random.random() < OTHER_PACE_SHARE
        hop = int(HOP * random.uniform(0.84, 1.22)) if other_pace else HOP
        made = [self._spoilt(clip) for clip in clips]
        counts = torch.tensor([len(wave) for wave, _ in made])
        stacked = torch.zeros(len(made), int(counts.max()))
        for row, (wave, _) in enumerate(made):
            stacked[row, : len(wave)] = torch.from_numpy(wave)
        warps = torch.from_numpy(random.integers(len(WARPS), size=len(made)))
        gains = torch.from_numpy(draw_gains(len(made), MELS, random))
        told = frames(stacked, counts, hop, warps, gains)
        length = told.shape[2] + int(random.integers(*PADDING_FRAMES))
        length += length % FRAMES_PER_STATE
        state_s = FRAMES_PER_STATE * hop / RATE_HZ
        targets = np.stack([_targets(e, length // FRAMES_PER_STATE, state_s) for _, e in made])
        padded = torch.nn.functional.pad(told, (0, length - told.shape[2]))
        return Batch(frames=padded, targets=torch.from_numpy(targets))

    def _spoilt(self, clip: Said) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Return one clip's sound, spoilt, and its words in seconds from its beginning."""
        random = self._random
        lead_s, tail_s = random.uniform(0.0, 0.5), random.uniform(0.0, 0.6)
        wave = self._spoiler.spoil(_wave(clip), lead_s, tail_s, random)
        events = clip.events + np.array((0.0, lead_s, lead_s), np.float32)
        if random.random() < CUT_SHARE:
            first_s = float(events[-1, 2]) if len(events) else lead_s + 0.2
            wave = wave[: int(RATE_HZ * max(first_s, random.uniform(0.0, len(wave) / RATE_HZ)))]
        return np.ascontiguousarray(wave, np.float32), events


def _wave(clip: Said) -> NDArray[np.float32]:
    return clip.samples.astype(np.float32) / np.float32(32_767.0)


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
