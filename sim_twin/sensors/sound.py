"""Emulate a microphone and a speaker in a room: a test plays to the one and hears the other."""

from collections import deque

import numpy as np

from drivers.audio.base import AudioFormat, Samples, check_samples
from drivers.audio.pcm_protocol import PcmBlock, PcmParser, encode_block
from drivers.clock import NS_PER_S

NOISE_SIGMA = 12.0
MAX_BACKLOG_S = 1.0
MAX_HEARD_S = 60.0


class MicrophoneDevice:
    """Send what is played in the room, over a little noise, as fast as time passes.

    Samples are made when somebody reads them; a room that nobody listens to costs nothing.
    """

    def __init__(self, format_: AudioFormat, *, seed: int = 0) -> None:
        self.format = format_
        self._random = np.random.default_rng(seed)
        self._now_ns = 0
        self._sent_rows = 0
        self._playing: deque[tuple[int, Samples]] = deque()

    def play(self, samples: Samples) -> None:
        """Play sound in the room, after what is being played.

        Raises:
            ValueError: the samples do not have the microphone's channels.
        """
        check_samples(samples, self.format)
        starts = self._row_now()
        if self._playing:
            last_start, last = self._playing[-1]
            starts = max(starts, last_start + len(last))
        self._playing.append((starts, samples))

    def announce(self) -> None:
        """Begin with the present for the next host."""
        self._sent_rows = self._row_now()

    def receive(self, data: bytes) -> None:
        """Ignore what the host sends: a microphone only listens."""

    def transmit(self) -> bytes:
        """Return what was to be heard since the last call, at most the last second."""
        now = self._row_now()
        first = max(self._sent_rows, now - round(MAX_BACKLOG_S * self.format.rate_hz))
        self._sent_rows = now
        if now <= first:
            return b""
        stamp_ns = self.format.duration_ns(first)
        block = PcmBlock(
            format=self.format,
            first_row=first,
            stamp_ns=stamp_ns,
            samples=self._heard(first, now),
        )
        return encode_block(block)

    def step(self, now_ns: int) -> None:
        """Let time pass."""
        self._now_ns = now_ns

    def _row_now(self) -> int:
        return self._now_ns * self.format.rate_hz // NS_PER_S

    def _heard(self, first: int, end: int) -> Samples:
        sound = NOISE_SIGMA * self._random.standard_normal((end - first, self.format.channels))
        for starts, samples in self._playing:
            low, high = max(first, starts), min(end, starts + len(samples))
            if low < high:
                sound[low - first : high - first] += samples[low - starts : high - starts]
        while self._playing and self._playing[0][0] + len(self._playing[0][1]) <= end:
            self._playing.popleft()
        return np.rint(sound).clip(-32_768, 32_767).astype(np.int16)


class SpeakerDevice:
    """Keep what the robot says, the last minute of it."""

    def __init__(self, format_: AudioFormat) -> None:
        self.format = format_
        self._parser = PcmParser()
        self._said: Samples = np.zeros((0, format_.channels), np.int16)

    def said(self) -> Samples:
        """Return what the robot has said since the last call."""
        said, self._said = self._said, self._said[:0]
        return said

    def announce(self) -> None:
        """Begin with a fresh stream for the next host."""
        self._parser = PcmParser()

    def receive(self, data: bytes) -> None:
        """Take sound; blocks of another format make a noise that nobody understands."""
        blocks = [b.samples for b in self._parser.feed(data) if b.format == self.format]
        kept = round(MAX_HEARD_S * self.format.rate_hz)
        self._said = np.concatenate([self._said, *blocks])[-kept:]

    def transmit(self) -> bytes:
        """Return nothing: a speaker only listens to its host."""
        return b""

    def step(self, now_ns: int) -> None:
        """Let time pass; a speaker plays as it is told."""
