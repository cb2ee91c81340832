"""Look for stop words in what the recogniser's encoder makes of a phrase."""

from typing import Final

from torch import Tensor, nn
from torch.nn import functional

from training.stop_words.texts import WORDS

CHANNELS: Final = 64
REACH: Final = 9
"""Of each layer, in states of 40 ms: two layers see 0.7 s, as long as a word."""


class StopHead(nn.Module):
    """Give each state of the encoder a score for each word, and for none of them."""

    def __init__(self, width: int) -> None:
        super().__init__()
        self.near = nn.Conv1d(width, CHANNELS, REACH, padding=REACH // 2)
        self.far = nn.Conv1d(CHANNELS, CHANNELS, REACH, padding=REACH // 2)
        self.last = nn.Linear(CHANNELS, 1 + len(WORDS))
        self.drop = nn.Dropout(0.1)

    def forward(self, states: Tensor) -> Tensor:
        """Return logits (clip, time, class) of states (clip, time, width); class 0 is no word."""
        x = functional.relu(self.near(self.drop(states).transpose(1, 2)))
        x = functional.relu(self.far(self.drop(x)))
        out: Tensor = self.last(x.transpose(1, 2))
        return out
