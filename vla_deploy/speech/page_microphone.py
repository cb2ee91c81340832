"""Hear what a person says into the page, a turn at a time: push to talk.

A turn that was let go is followed by the silence that ends its phrase, so that nobody waits for it.
When one is cut off, by a lost connection or because nothing comes any more, the phrase under way is
forgotten: half a command may mean another one.
"""

import logging
from collections.abc import Iterator
from typing import Final

import numpy as np

from drivers.audio.base import AudioFormat
from drivers.clock import NS_PER_S, Clock
from vla_deploy.ipc import BadPayload, RecordReader
from vla_deploy.ipc.page_sound import PageSound, SoundStep, unpacked
from vla_deploy.speech.errors import SpeechMissing
from vla_deploy.speech.microphone import Resampler
from vla_deploy.speech.sound import FRAME, Framer, Sound, SoundBlock, count_of, duration_ns

TAIL_S: Final = 0.3
"""Silence beyond what ends a phrase: frames do not end where a turn does."""
SILENT_NS: Final = 3 * NS_PER_S
_log = logging.getLogger(__name__)


class PageMicrophone:
    """Follow the turns of topic `page_sound`."""

    def __init__(self, records: RecordReader, clock: Clock) -> None:
        self._records = records
        self._clock = clock
        self._turn: int | None = None
        self._resampler: Resampler | None = None
        self._framer = Framer()
        self._heard_ns = self._end_ns = 0

    @property
    def is_open(self) -> bool:
        """Return whether a person holds the button."""
        return self._resampler is not None

    def poll(self, silence_s: float) -> Iterator[SoundBlock]:
        """Yield the frames said since the last call; a turn's end is so much silence, or a gap."""
        for record in self._records.fresh():
            try:
                yield from self._take(unpacked(record.payload), silence_s)
            except BadPayload as error:
                _log.warning("dropped what the page sent: %s", error)
        if self._clock.now_ns() - self._heard_ns > SILENT_NS:
            yield from self._cut_off()

    def _take(self, sound: PageSound, silence_s: float) -> Iterator[SoundBlock]:
        if sound.turn != self._turn:
            yield from self._cut_off()
            self._begin(sound)
        if self._resampler is None:
            return
        self._heard_ns = self._clock.now_ns()
        if len(sound.samples):
            yield from self._frames(self._resampler.feed(sound.samples[:, None]))
        if sound.step is SoundStep.ENDED:
            yield from self._frames(np.zeros(count_of(silence_s + TAIL_S), np.float32))
            self._resampler = None
        elif sound.step is SoundStep.CUT:
            yield from self._cut_off()

    def _begin(self, sound: PageSound) -> None:
        self._turn, self._end_ns = sound.turn, 0
        if sound.step is not SoundStep.SOUND:
            return  # the end of a turn of which nothing came
        try:
            self._resampler = Resampler(AudioFormat(rate_hz=sound.rate_hz))
        except SpeechMissing as error:
            _log.error("degraded: nobody is heard by the page: %s", error)

    def _frames(self, samples: Sound) -> Iterator[SoundBlock]:
        """Cut sound that ends now, behind what was heard before: no browser's clock counts."""
        stamp_ns = max(self._end_ns, self._heard_ns - duration_ns(len(samples)))
        block = SoundBlock(stamp_ns=stamp_ns, samples=samples, follows=self._end_ns > 0)
        self._end_ns = block.end_ns
        yield from self._framer.feed(block)

    def _cut_off(self) -> Iterator[SoundBlock]:
        """Leave a gap, by which whatever was begun is forgotten."""
        if self._resampler is not None:
            self._resampler = None
            now_ns = self._clock.now_ns()
            yield SoundBlock(stamp_ns=now_ns, samples=np.zeros(FRAME, np.float32), follows=False)
