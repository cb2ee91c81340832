"""Define the network: convolutions over time that look at the last second, and no state to carry.

All of them are without padding. So what it says of a moment is the same, whether it is given a
whole clip in training or the last second of a stream on board.
"""

from typing import Final

import torch
from torch import Tensor, nn

from training.voices.phones import PHONES
from vla_deploy.speech.stop_words.features import BANDS, STRIDE

CHANNELS: Final = 160
FIRST_TAPS: Final = 5
TAPS: Final = 5
DILATIONS: Final = (1, 1, 2, 2, 4, 4, 4)
REACH: Final = FIRST_TAPS + STRIDE * (TAPS - 1) * sum(DILATIONS)
"""Frames in that one frame out looks at."""


def _convolution(channels: int, taps: int, **how: int) -> nn.Conv2d:
    """Return a convolution over time; the kernels for two dimensions are several times quicker."""
    across = {name: (1, count) for name, count in how.items()}
    return nn.Conv2d(channels, CHANNELS, (1, taps), bias=False, **across)


class ResidualBlock(nn.Module):
    """Mix over time and channels, and add it to what came in."""

    def __init__(self, dilation: int) -> None:
        super().__init__()
        self.cut = (TAPS - 1) * dilation
        self.mix = _convolution(CHANNELS, TAPS, dilation=dilation)
        self.norm = nn.BatchNorm2d(CHANNELS)

    def forward(self, x: Tensor) -> Tensor:
        """Return fewer frames than came in: those whose past was whole."""
        return torch.relu(self.norm(self.mix(x)) + x[..., self.cut :])


class StopNet(nn.Module):
    """Give a logit for no word and for each word: (batch, BANDS, frames) to (batch, 1 + words, n).

    n is (frames - REACH) // STRIDE + 1. Beside it a head names the phone that sounds; it is there
    to learn by, and is not shipped.
    """

    def __init__(self, words: int) -> None:
        super().__init__()
        self.first = nn.Sequential(
            _convolution(BANDS, FIRST_TAPS, stride=STRIDE),
            nn.BatchNorm2d(CHANNELS),
            nn.ReLU(),
        )
        self.blocks = nn.Sequential(*(ResidualBlock(dilation) for dilation in DILATIONS))
        self.last = nn.Conv2d(CHANNELS, 1 + words, 1)
        self.phones = nn.Conv2d(CHANNELS, len(PHONES), 1)

    def forward(self, frames: Tensor) -> Tensor:
        """Return the logits."""
        logits: Tensor = self.last(self._states(frames))
        return logits.squeeze(2)

    def with_phones(self, frames: Tensor) -> tuple[Tensor, Tensor]:
        """Return the logits of words and of phones (batch, phones, n)."""
        states = self._states(frames)
        return self.last(states).squeeze(2), self.phones(states).squeeze(2)

    def _states(self, frames: Tensor) -> Tensor:
        states: Tensor = self.blocks(self.first(frames.unsqueeze(2)))
        return states


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
