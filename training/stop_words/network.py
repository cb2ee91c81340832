"""Define the network: convolutions over time that look at the last second, and no state to carry.

All of them are without padding. So what it says of a moment is the same, whether it is given a
whole clip in training or the last second of a stream on board.
"""

from typing import Final

import torch
from torch import Tensor, nn

from training.voices.phones import PHONES
from vla_deploy.speech.stop_words.features import BANDS, STRIDE

CHANNELS: Final = 256
FIRST_TAPS: Final = 5
TAPS: Final = 5
DILATIONS: Final = (1, 1, 2, 2, 4, 4, 4)
REACH: Final = FIRST_TAPS + STRIDE * (TAPS - 1) * sum(DILATIONS)
"""Frames in that one frame out looks at."""


class Block(nn.Module):
    """Mix over time channel by channel, then over channels, and add it to what came in."""

    def __init__(self, dilation: int) -> None:
        super().__init__()
        self.cut = (TAPS - 1) * dilation
        self.over_time = nn.Conv1d(
            CHANNELS, CHANNELS, TAPS, dilation=dilation, groups=CHANNELS, bias=False
        )
        self.norm_time = nn.BatchNorm1d(CHANNELS)
        self.over_channels = nn.Conv1d(CHANNELS, CHANNELS, 1, bias=False)
        self.norm_channels = nn.BatchNorm1d(CHANNELS)

    def forward(self, x: Tensor) -> Tensor:
        """Return fewer frames than came in: those whose past was whole."""
        mixed = torch.relu(self.norm_time(self.over_time(x)))
        mixed = self.norm_channels(self.over_channels(mixed))
        return torch.relu(mixed + x[:, :, self.cut :])


class StopNet(nn.Module):
    """Give a logit for no word and for each word: (batch, BANDS, frames) to (batch, 1 + words, n).

    n is (frames - REACH) // STRIDE + 1. Beside it a head names the phone that sounds; it is there
    to learn by, and is not shipped.
    """

    def __init__(self, words: int) -> None:
        super().__init__()
        self.first = nn.Sequential(
            nn.Conv1d(BANDS, CHANNELS, FIRST_TAPS, stride=STRIDE, bias=False),
            nn.BatchNorm1d(CHANNELS),
            nn.ReLU(),
        )
        self.blocks = nn.Sequential(*(Block(dilation) for dilation in DILATIONS))
        self.last = nn.Conv1d(CHANNELS, 1 + words, 1)
        self.phones = nn.Conv1d(CHANNELS, len(PHONES), 1)

    def forward(self, frames: Tensor) -> Tensor:
        """Return the logits."""
        logits: Tensor = self.last(self.blocks(self.first(frames)))
        return logits

    def with_phones(self, frames: Tensor) -> tuple[Tensor, Tensor]:
        """Return the logits of words and of phones (batch, phones, n)."""
        states = self.blocks(self.first(frames))
        return self.last(states), self.phones(states)


TEMPERATURE: Final = 3.0
"""Learning leaves the network too sure of all it says, right or wrong: the logits are divided by
this, so that a mean over moments tells more than how many of them were near 1."""


class Scores(nn.Module):
    """Give scores, as the file on board does."""

    def __init__(self, net: StopNet) -> None:
        super().__init__()
        self.net = net

    def forward(self, frames: Tensor) -> Tensor:
        """Return the score of none and of each word; they add up to 1."""
        return torch.softmax(self.net(frames) / TEMPERATURE, dim=1)
