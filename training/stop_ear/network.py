"""Look for stop words in a phrase: the recogniser's encoder, taught this alone, and a head."""

from typing import Final

from torch import Tensor, nn
from torch.nn import functional

from training.speech.network import Encoder
from training.speech.sizes import SIZES
from training.stop_words.texts import WORDS

SIZE: Final = SIZES["full"]
CHANNELS: Final = 64
REACH: Final = 9
"""Of each layer of the head, in states of 40 ms: two layers see 0.7 s, as long as a word."""


class StopEar(nn.Module):
    """Give each 40 ms of a phrase a score for each word, and for none of them."""

    def __init__(self, encoder: Encoder) -> None:
        super().__init__()
        self.encoder = encoder
        self.near = nn.Conv1d(SIZE.width, CHANNELS, REACH, padding=REACH // 2)
        self.far = nn.Conv1d(CHANNELS, CHANNELS, REACH, padding=REACH // 2)
        self.last = nn.Linear(CHANNELS, 1 + len(WORDS))
        self.drop = nn.Dropout(0.1)

    def forward(self, frames: Tensor) -> Tensor:
        """Return logits (clip, time, class) of frames (clip, mel, frame); class 0 is no word."""
        states = self.encoder(frames).float()
        x = functional.relu(self.near(self.drop(states).transpose(1, 2)))
        x = functional.relu(self.far(self.drop(x)))
        out: Tensor = self.last(x.transpose(1, 2))
        return out
