"""Take clips of like length together and turn their waves into frames, each time another way."""

from collections.abc import Iterator, Sequence
from typing import Final

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from training.speech.clips.features import HOP, WARPS, frames
from training.speech.clips.spoiling import draw_gains
from training.speech.network import FRAMES_PER_STATE, MELS
from training.voices.clip import Wave

IGNORED: Final = -100
"""The target that counts for nothing."""
PADDING_FRAMES: Final = (20, 60)
_SPARE_S: Final = 1.3
"""By which a clip may become longer than it was spoken."""

Random = np.random.Generator


def in_groups(
    lengths_s: NDArray[np.float64], batch_s: float, random: Random, share: float = 1.0
) -> Iterator[list[int]]:
    """Yield the numbers of all clips, or of the shorter share, once, in groups of like length.

    A group lasts `batch_s` at most, padding counted.
    """
    order = np.argsort(lengths_s * random.uniform(0.92, 1.08, len(lengths_s)))
    order = order[: max(1, int(len(order) * share))]
    groups: list[list[int]] = [[]]
    for number in order:
        longest_s = lengths_s[number] + _SPARE_S
        if groups[-1] and longest_s * (len(groups[-1]) + 1) > batch_s:
            groups.append([])
        groups[-1].append(int(number))
    for place in random.permutation(len(groups)):
        yield groups[place]


def draw_hop(random: Random) -> int:
    """Draw how many samples a frame goes on: most often another pace of speech."""
    return int(HOP * random.uniform(0.84, 1.22)) if random.random() < 0.6 else HOP


def framed(waves: Sequence[Wave], hop: int, random: Random) -> Tensor:
    """Return frames (clip, mel, frame) of waves, each by another throat and microphone."""
    counts = torch.tensor([len(wave) for wave in waves])
    stacked = torch.zeros(len(waves), int(counts.max()))
    for row, wave in enumerate(waves):
        stacked[row, : len(wave)] = torch.from_numpy(wave)
    warps = torch.from_numpy(random.integers(len(WARPS), size=len(waves)))
    gains = torch.from_numpy(draw_gains(len(waves), MELS, random))
    return frames(stacked, counts, hop, warps, gains)


def padded(made: Tensor, random: Random, length: int | None = None) -> Tensor:
    """Return frames padded by chance, or to a length, up to a whole state."""
    if length is None:
        length = made.shape[2] + int(random.integers(*PADDING_FRAMES))
    length += length % FRAMES_PER_STATE
    return torch.nn.functional.pad(made, (0, length - made.shape[2]))
