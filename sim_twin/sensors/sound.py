"""Emulate a microphone and a speaker in a room: a test plays to the one and hears the other."""

from typing import Final

import numpy as np

from drivers.audio.base import FULL_SCALE, AudioFormat, Samples, check_samples
from drivers.audio.clip import Clip, Wave
from drivers.audio.pcm_protocol import PcmBlock, PcmParser, encode_block
from drivers.clock import NS_PER_S
from drivers.device_clock import DeviceClock
from sim_twin.sound.room import Room

LATENCY_NS: Final = 30 * NS_PER_S // 1000
"""Of the speaker; longer than bytes are usually held up."""
MAX_BACKLOG_S: Final = 1.0
MAX_HEARD_S: Final = 60.0
_SAME_NS: Final = 1_000


class MicrophoneDevice:
    """Send what arrives from the room, over a little noise, as fast as time passes."""

    def __init__(self, format_: AudioFormat, *, seed: int = 0, room: Room | None = None) -> None:
        self.format = format_
        self.room = room or Room(format_.rate_hz, seed)
        self.now_ns = 0
        self._sent_rows = 0
        self._played_rows = 0

    def play(self, samples: Samples) -> None:
        """Play sound straight to the microphone, after what was played so before.

        Raises:
            ValueError: the samples do not have the microphone's channels.
        """
        check_samples(samples, self.format)
        starts = max(self._row_now(), self._played_rows)
        self._played_rows = starts + len(samples)
        self.room.lay(_wave(samples), starts)

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
        block = PcmBlock(
            format=self.format,
            first_row=first,
            stamp_ns=self.format.duration_ns(first),
            samples=self.room.heard(first, now, self.format.channels),
        )
        return encode_block(block)

    def step(self, now_ns: int) -> None:
        """Let time pass."""
        self.now_ns = now_ns

    def _row_now(self) -> int:
        return self.room.row_at(self.now_ns)


class SpeakerDevice:
    """Sound in the room, if there is one, and keep what the robot says, the last minute of it.

    It plays by the stamps of the blocks, some time later: so the way from the robot's words to its
    ear takes as long each time it speaks, whatever held the bytes up.
    """

    def __init__(self, format_: AudioFormat, room: Room | None = None) -> None:
        self.format = format_
        self._room = room
        self._now_ns = 0
        self._parser = PcmParser()
        self._host_clock = DeviceClock()
        self._next_stamp_ns = 0
        self._ends_ns = 0
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
        blocks = [block for block in self._parser.feed(data) if block.format == self.format]
        for block in blocks:
            self._sound(block)
        kept = round(MAX_HEARD_S * self.format.rate_hz)
        self._said = np.concatenate([self._said, *(block.samples for block in blocks)])[-kept:]

    def transmit(self) -> bytes:
        """Return nothing: a speaker only listens to its host."""
        return b""

    def step(self, now_ns: int) -> None:
        """Let time pass; a speaker plays as it is told."""
        self._now_ns = now_ns

    def _sound(self, block: PcmBlock) -> None:
        starts_ns = self._starts_ns(block)
        self._next_stamp_ns = block.stamp_ns + self.format.duration_ns(len(block.samples))
        self._ends_ns = starts_ns + self.format.duration_ns(len(block.samples))
        if self._room is not None:
            clip = Clip(rate_hz=self.format.rate_hz, wave=_wave(block.samples))
            self._room.sound_from_speaker(clip.at_rate(self._room.rate_hz).wave, starts_ns)

    def _starts_ns(self, block: PcmBlock) -> int:
        """Return when a block sounds: behind the one that it follows, else by its stamp."""
        stamped_ns = self._host_clock.to_host_ns(block.stamp_ns, self._now_ns)
        if abs(block.stamp_ns - self._next_stamp_ns) < _SAME_NS and self._ends_ns > self._now_ns:
            return self._ends_ns
        return max(stamped_ns + LATENCY_NS, self._now_ns)


def _wave(samples: Samples) -> Wave:
    """Return the mean of the channels as a share of full scale."""
    wave: Wave = (samples.mean(axis=1) / FULL_SCALE).astype(np.float32)
    return wave
