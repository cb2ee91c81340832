"""Cut the stream into phrases: where somebody begins to speak, pauses, goes on, and has ended.

Pure but for what it remembers: a frame and its judgement in, events out.
"""

from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass
from enum import Enum
from typing import Final

import numpy as np

from drivers.clock import NS_PER_S
from platforms import SpeechSettings
from vla_deploy.speech.sound import FRAME_S, Sound, SoundBlock

ONSET: Final = 0.5
OFFSET: Final = 0.45
ONSET_FRAMES: Final = 2
PAUSE_RATIO: Final = 0.6
"""After this share of the silence that ends a phrase, its words are read in advance."""


class VadEventKind(Enum):
    """Name what may happen to a phrase that somebody has begun."""

    PAUSED = "long enough to read the words so far in advance"
    RESUMED = "the speaker goes on"
    ENDED = "the speaker has ended"
    TOO_SHORT = "it was too short to be a word"
    TOO_LONG = "the speaker goes on for longer than a command may take"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Phrase:
    """Hold what somebody said.

    `began_ns`, which no two phrases share, and `ended_ns` are those of the voice; the samples begin
    before and end after it. `own_words` are what the robot was saying, where it may have heard
    itself.
    """

    began_ns: int
    ended_ns: int
    samples: Sound
    own_words: str = ""


VadEvent = tuple[VadEventKind, Phrase]
"""What has happened, and the phrase so far."""


class Endpointer:
    """Follow one stream."""

    def __init__(self, settings: SpeechSettings) -> None:
        self.settings = settings
        self._before: deque[SoundBlock] = deque()
        self._frames: list[SoundBlock] = []
        self._began_ns = self._ended_ns = 0
        self._rising = 0
        self._silent = 0
        self._patience_s = settings.end_silence_s
        self._swallowing = False

    @property
    def is_open(self) -> bool:
        """Return whether somebody is speaking, or pausing in a phrase."""
        return bool(self._frames)

    def wait_longer(self) -> None:
        """Let the present pause last longer: its words so far cannot be all."""
        self._patience_s = self.settings.unfinished_silence_s

    def reset(self) -> None:
        """Forget what was begun, as at a gap in the stream."""
        self._before.clear()
        self._close()
        self._swallowing = False

    def feed(self, frame: SoundBlock, voice: float) -> Iterator[VadEvent]:
        """Take the next frame, and how probably it holds a voice."""
        if self._frames:
            yield from self._go_on(frame, voice)
        else:
            self._wait(frame, voice)

    def _wait(self, frame: SoundBlock, voice: float) -> None:
        self._before.append(frame)
        self._rising = self._rising + 1 if voice >= ONSET else 0
        if self._swallowing:
            self._count_silence(voice)
            self._swallowing = self._silent * FRAME_S < self.settings.unfinished_silence_s
            self._rising = 0
        kept = round(self.settings.pre_roll_s / FRAME_S) + ONSET_FRAMES
        while len(self._before) > kept:
            self._before.popleft()
        if self._rising >= ONSET_FRAMES:
            self._open()

    def _open(self) -> None:
        self._frames = list(self._before)
        self._began_ns = self._frames[-ONSET_FRAMES].stamp_ns
        self._ended_ns = self._frames[-1].end_ns
        self._before.clear()
        self._silent = 0
        self._patience_s = self.settings.end_silence_s

    def _go_on(self, frame: SoundBlock, voice: float) -> Iterator[VadEvent]:
        paused = self._silent >= self._pause_frames
        self._frames.append(frame)
        self._count_silence(voice)
        if self._silent == 0:
            self._ended_ns = frame.end_ns
        if self._silent == 0 and paused:
            self._patience_s = self.settings.end_silence_s
            yield VadEventKind.RESUMED, self._phrase()
        if self._silent * FRAME_S >= self._patience_s:
            yield self._end()
        elif len(self._frames) * FRAME_S >= self.settings.longest_phrase_s:
            yield VadEventKind.TOO_LONG, self._phrase()
            self._close()
            self._swallowing = True
        elif self._silent == self._pause_frames:
            yield VadEventKind.PAUSED, self._phrase()

    @property
    def _pause_frames(self) -> int:
        return max(1, int(PAUSE_RATIO * self.settings.end_silence_s / FRAME_S))

    def _count_silence(self, voice: float) -> None:
        self._silent = 0 if voice >= OFFSET else self._silent + 1

    def _end(self) -> VadEvent:
        phrase = self._phrase()
        is_word = phrase.ended_ns - phrase.began_ns >= self.settings.shortest_phrase_s * NS_PER_S
        self._close()
        return VadEventKind.ENDED if is_word else VadEventKind.TOO_SHORT, phrase

    def _close(self) -> None:
        self._frames = []
        self._silent = self._rising = 0

    def _phrase(self) -> Phrase:
        """Return the phrase so far."""
        samples = np.concatenate([frame.samples for frame in self._frames])
        return Phrase(began_ns=self._began_ns, ended_ns=self._ended_ns, samples=samples)
