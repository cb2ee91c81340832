"""Make batches: clips of like length, spoilt, with their tokens and sounds."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
import torch
from torch import Tensor

from training.speech.clips.framing import IGNORED, draw_hop, framed, in_groups, padded
from training.speech.clips.spoiling import Spoiler
from training.speech.network import LARGEST_FRAMES, MELS
from training.speech.tokens import Coder
from training.voices.clip import RATE_HZ, Wave
from training.voices.clip_store import StoredClip, read_shard, shards
from training.voices.phones import NUMBERS

_LARGEST_CLIP_S: Final = 9.0
_EMPTY_SHARE: Final = 0.04
"""Of clips without speech, from which the model learns to write nothing."""
_WIDE_SHARE: Final = 0.01
"""Of batches padded to Whisper's whole half minute."""
_WIDE_CLIPS: Final = 4

Random = np.random.Generator


@dataclass(frozen=True, slots=True, kw_only=True)
class SpeechBatch:
    """Hold what one step learns from; targets that are IGNORED count for nothing."""

    frames: Tensor
    tokens: Tensor
    targets: Tensor
    sounds: Tensor
    duration_s: float


class ClipPool:
    """Hold the clips that are there; more may come while a training runs."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._read: set[Path] = set()
        self.clips: list[StoredClip] = []

    def refresh(self) -> int:
        """Take up finished shards; return how many clips there are."""
        for shard in shards(self._folder):
            if shard not in self._read:
                self._read.add(shard)
                fitting = (c for c in read_shard(shard) if len(c.data) < _LARGEST_CLIP_S * RATE_HZ)
                self.clips += fitting
        return len(self.clips)

    def groups(
        self, batch_s: float, random: Random, short_share: float
    ) -> Iterator[list[StoredClip]]:
        """Yield all clips once in groups of like length, or the shorter share of them alone."""
        lengths_s = np.array([len(clip.data) for clip in self.clips]) / RATE_HZ
        for group in in_groups(lengths_s, batch_s, random, short_share):
            yield [self.clips[number] for number in group]


class Maker:
    """Make batches of clips."""

    def __init__(self, coder: Coder, spoiler: Spoiler) -> None:
        self._coder = coder
        self._spoiler = spoiler

    def make(self, clips: Sequence[StoredClip], random: Random) -> SpeechBatch:
        """Return the batch; the same clips come out differently each time."""
        wide = random.random() < _WIDE_SHARE
        clips = clips[:_WIDE_CLIPS] if wide else clips
        hop = draw_hop(random)
        empty = random.random(len(clips)) < _EMPTY_SHARE
        leads_s = random.uniform(0.0, 0.5, len(clips))
        waves = [
            self._no_speech(len(clip.data), random)
            if bare
            else self._spoiler.spoil(clip.samples, lead_s, random.uniform(0.0, 0.6), random)
            for clip, bare, lead_s in zip(clips, empty, leads_s, strict=True)
        ]
        made = framed(waves, hop, random)
        _mask(made, random)
        made = padded(made, random, LARGEST_FRAMES if wide else None)
        sounds = np.full((len(clips), made.shape[2]), IGNORED)
        for row, (clip, bare, lead_s) in enumerate(zip(clips, empty, leads_s, strict=True)):
            inside = (len(waves[row]) + 160) // hop
            sounds[row, :inside] = 0 if bare else _sounds(clip, float(lead_s), hop, inside)
        tokens, targets = self._texts(clips, empty, random)
        return SpeechBatch(
            frames=made,
            tokens=tokens,
            targets=targets,
            sounds=torch.from_numpy(sounds),
            duration_s=made.shape[2] * len(clips) * hop / RATE_HZ,
        )

    def _no_speech(self, count: int, random: Random) -> Wave:
        """Return noise alone, or next to silence."""
        made = self._spoiler.noise(count, random)
        return made * np.float32(10.0 ** random.uniform(-4.0, -0.7))

    def _texts(
        self, clips: Sequence[StoredClip], empty: "np.ndarray[tuple[int], np.dtype[np.bool_]]",
        random: Random,
    ) -> tuple[Tensor, Tensor]:  # fmt: skip
        coder = self._coder
        rows: list[tuple[list[int], list[int]]] = []
        for clip, bare in zip(clips, empty, strict=True):
            text = [] if bare else coder.text(clip.text)
            first = coder.no_speech if bare else coder.bare
            rows.append((
                [coder.start, coder.bare, *text],
                [first, *text, coder.end],
            ))  # fmt: skip
        longest = max(len(row) for row, _ in rows)
        tokens = torch.full((len(rows), longest), coder.end)
        targets = torch.full((len(rows), longest), IGNORED)
        for number, (row, aims) in enumerate(rows):
            tokens[number, : len(row)] = torch.tensor(row)
            targets[number, : len(aims)] = torch.tensor(aims)
        return tokens, targets


def _sounds(
    clip: StoredClip, lead_s: float, hop: int, count: int
) -> "np.ndarray[tuple[int], np.dtype[np.int64]]":
    """Return the sound in the middle of each frame."""
    if not clip.sounds:
        return np.full(count, IGNORED)
    began_s = np.array([one.began_s for one in clip.sounds]) + lead_s
    numbers = np.array([NUMBERS[one.phone] for one in clip.sounds])
    times_s = np.arange(count) * hop / RATE_HZ
    place = np.searchsorted(began_s, times_s, side="right") - 1
    told = np.where(place >= 0, numbers[np.maximum(place, 0)], 0)
    return np.where(times_s > lead_s + len(clip.data) / RATE_HZ, 0, told)


def _mask(made: Tensor, random: Random) -> None:
    """Blank a few frames and bands of some clips."""
    for row in np.flatnonzero(random.random(len(made)) < 0.5):
        width, start = int(random.integers(1, 10)), int(random.integers(max(1, made.shape[2] - 10)))
        made[row, :, start : start + width] = 0.0
        band, low = int(random.integers(1, 12)), int(random.integers(MELS - 12))
        made[row, low : low + band] = 0.0
