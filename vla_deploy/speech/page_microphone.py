"""Hear what a person says into the page, a turn at a time: push to talk.

A turn that was let go is followed by the silence that ends its phrase, so that nobody waits for it.
When one is cut off, by a lost connection or because nothing comes any more, the phrase under way is
forgotten: half a command may mean another one.
"""

import logging
from collections.abc import Iterator
from typing import Any, Final

import numpy as np

from drivers.audio.base import AudioFormat
from drivers.clock import NS_PER_S, Clock
from vla_deploy.ipc import BadPayload, RecordReader
from vla_deploy.ipc.page_sound import PageSound, Step, unpacked
from vla_deploy.speech.errors import SpeechMissing
from vla_deploy.speech.microphone import Resampler
from vla_deploy.speech.sound import FRAME, Sound, SoundBlock, count_of, duration_ns

TAIL_S: Final = 0.3
"""Silence beyond what ends a phrase: frames do not end where a turn does."""
SILENT_NS: Final = 3 * NS_PER_S
_log = logging.getLogger(__name__)


class _Turn:
    """Hold the turn of one speaker; a browser's clock means nothing here."""

    def __init__(self, sound: PageSound, now_ns: int) -> None:
        self.number = sound.turn
        self.heard_ns = now_ns
        self._resampler = Resampler(AudioFormat(rate_hz=sound.rate_hz))
        self._end_ns = 0

    def heard(self, sound: PageSound, now_ns: int) -> SoundBlock:
        """Return what has arrived now."""
        self.heard_ns = now_ns
        return self.block(self._resampler.feed(sound.samples[:, None]))

    def block(self, samples: Sound) -> SoundBlock:
        """Return sound that ends now, behind what was heard before."""
        stamp_ns = max(self._end_ns, self.heard_ns - duration_ns(len(samples)))
        block = SoundBlock(stamp_ns=stamp_ns, samples=samples, follows=self._end_ns > 0)
        self._end_ns = block.end_ns
        return block


class PageMicrophone:
    """Follow the turns of topic `page_sound`."""

    def __init__(self, records: RecordReader, clock: Clock) -> None:
        self._records = records
        self._clock = clock
        self._turn: _Turn | None = None
        self._why = ""
        self._turns = self._cut = 0

    @property
    def is_open(self) -> bool:
        """Return whether a person holds the button."""
        return self._turn is not None

    def poll(self, silence_s: float) -> Iterator[SoundBlock]:
        """Yield what was said since the last call; a turn's end is so much silence, or a gap."""
        for record in self._records.fresh():
            try:
                yield from self._take(unpacked(record.payload), silence_s)
            except BadPayload as error:
                _log.warning("dropped what the page sent: %s", error)
        turn = self._turn
        if turn is not None and self._clock.now_ns() - turn.heard_ns > SILENT_NS:
            yield from self._cut_off()

    def document(self) -> dict[str, Any]:
        """Return how it fares, as `speech_status` tells it."""
        counts = {"turns": self._turns, "cut": self._cut}
        return {"speaking": self.is_open, "why": self._why, **counts}

    def _take(self, sound: PageSound, silence_s: float) -> Iterator[SoundBlock]:
        if self._turn is None or self._turn.number != sound.turn:
            yield from self._cut_off()
            self._begin(sound)
        turn = self._turn
        if turn is None:
            return
        if len(sound.samples):
            yield turn.heard(sound, self._clock.now_ns())
        if sound.step is Step.ENDED:
            yield turn.block(np.zeros(count_of(silence_s + TAIL_S), np.float32))
            self._turn = None
        elif sound.step is Step.CUT:
            yield from self._cut_off()

    def _begin(self, sound: PageSound) -> None:
        if sound.step is not Step.SOUND:
            return  # the end of a turn of which nothing came
        try:
            self._turn = _Turn(sound, self._clock.now_ns())
        except SpeechMissing as error:
            self._why = str(error)
            return
        self._turns += 1
        self._why = ""

    def _cut_off(self) -> Iterator[SoundBlock]:
        """Leave a gap, by which whatever was begun is forgotten."""
        if self._turn is not None:
            self._cut += 1
            self._turn = None
            now_ns = self._clock.now_ns()
            yield SoundBlock(stamp_ns=now_ns, samples=np.zeros(FRAME, np.float32), follows=False)
