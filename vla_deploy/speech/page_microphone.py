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
from drivers.audio.pushed import PushedInput
from drivers.clock import Clock
from drivers.errors import LinkLost
from vla_deploy.ipc import BadPayload, RecordReader
from vla_deploy.ipc.page_sound import PageSound, Step, unpacked
from vla_deploy.speech.errors import SpeechMissing
from vla_deploy.speech.resampling import Resampler
from vla_deploy.speech.sound import FRAME, SoundBlock, count_of

TAIL_S: Final = 0.3
"""Silence beyond what ends a phrase: frames do not end where a turn does."""
_log = logging.getLogger(__name__)


class _Turn:
    """Hold the turn of one speaker."""

    def __init__(self, sound: PageSound, clock: Clock) -> None:
        format_ = AudioFormat(rate_hz=sound.rate_hz)
        self.number = sound.turn
        self.input = PushedInput(format_, clock)
        self._resampler = Resampler(format_)
        self._follows = False
        self._end_ns = clock.now_ns()

    def block(self) -> SoundBlock | None:
        """Return what has been pushed since the last call.

        Raises:
            LinkLost: nothing has been for too long.
        """
        pushed = self.input.poll()
        if pushed is None:
            return None
        samples = self._resampler.feed(pushed.samples)
        return self._stamped(samples, pushed.stamp_ns)

    def silence(self, seconds: float) -> SoundBlock:
        """Return so much silence after what was said."""
        return self._stamped(np.zeros(count_of(seconds), np.float32), self._end_ns)

    def _stamped(self, samples: "np.ndarray[Any, np.dtype[np.float32]]", at_ns: int) -> SoundBlock:
        block = SoundBlock(stamp_ns=at_ns, samples=samples, follows=self._follows)
        self._follows, self._end_ns = True, block.end_ns
        return block


class PageMicrophone:
    """Follow the turns of topic `page_sound`."""

    def __init__(self, records: RecordReader, clock: Clock) -> None:
        self._records = records
        self._clock = clock
        self._turn: _Turn | None = None
        self._why = ""
        self._turns = self._cut = self._lost = 0

    @property
    def is_open(self) -> bool:
        """Tell whether a person holds the button."""
        return self._turn is not None

    def poll(self, silence_s: float) -> Iterator[SoundBlock]:
        """Yield what was said since the last call; a turn's end is so much silence, or a gap."""
        for record in self._records.fresh():
            try:
                yield from self._take(unpacked(record.payload), silence_s)
            except BadPayload as error:
                _log.warning("dropped what the page sent: %s", error)
        if self._turn is not None:
            yield from self._heard(self._turn)

    def document(self) -> dict[str, Any]:
        """Return how it fares, as `speech_status` tells it."""
        return {
            "speaking": self.is_open,
            "why": self._why,
            "turns": self._turns,
            "cut": self._cut,
            "lost_samples": self._lost,
        }

    def _take(self, sound: PageSound, silence_s: float) -> Iterator[SoundBlock]:
        if self._turn is None or self._turn.number != sound.turn:
            yield from self._cut_off()
            self._begin(sound)
        turn = self._turn
        if turn is None:
            return
        turn.input.push(sound.samples[:, None])
        if sound.step is Step.ENDED:
            yield from self._heard(turn)
            yield turn.silence(silence_s + TAIL_S)
            self._close()
        elif sound.step is Step.CUT:
            yield from self._cut_off()

    def _begin(self, sound: PageSound) -> None:
        if sound.step is not Step.SOUND:
            return  # the end of a turn of which nothing came
        try:
            self._turn = _Turn(sound, self._clock)
        except SpeechMissing as error:
            self._why = str(error)
            return
        self._turns += 1
        self._why = ""

    def _heard(self, turn: _Turn) -> Iterator[SoundBlock]:
        try:
            block = turn.block()
        except LinkLost:
            yield from self._cut_off()
            return
        if block is not None:
            yield block

    def _cut_off(self) -> Iterator[SoundBlock]:
        """Leave a gap, by which whatever was begun is forgotten."""
        if self._turn is not None:
            self._cut += 1
            self._close()
            now_ns = self._clock.now_ns()
            yield SoundBlock(stamp_ns=now_ns, samples=np.zeros(FRAME, np.float32), follows=False)

    def _close(self) -> None:
        if self._turn is not None:
            self._lost += self._turn.input.counters.lost_samples
            self._turn.input.close()
        self._turn = None
