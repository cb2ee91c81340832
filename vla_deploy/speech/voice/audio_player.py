"""Play one sound at a time on a speaker that may come and go, and know what sounds when.

A sound is handed over bit by bit, so that the robot can fall silent at any moment.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np

from drivers.audio.base import AudioFormat, AudioOutput, Samples
from drivers.clock import NS_PER_S, Clock
from drivers.reopening import Reopening
from vla_deploy.speech.voice.clip import Wave

LEAD_NS: Final = 3 * NS_PER_S // 20
"""How far ahead of its sounding the speaker gets sound: what is handed over cannot be taken back,
and a busy computer must not tear holes."""
_FADE_S: Final = 0.008
OpenOutput = Callable[[], AudioOutput]
Note = Callable[[Wave, int, int], None]
"""Take a wave at 16 kHz, the time at which its first sample sounds, and until when it does."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Prepared:
    """Hold a sound as the speaker takes it, (n, channels), and as a wave at 16 kHz."""

    samples: Samples
    wave: Wave


class Playback:
    """Play samples of the speaker's format, (n, channels), after what it still plays.

    `ends_ns` is when what was handed over will have sounded.
    """

    def __init__(self, samples: Samples, ends_ns: int = 0) -> None:
        self.ends_ns = ends_ns
        self._samples = samples
        self._at = 0

    @property
    def has_begun(self) -> bool:
        """Return whether the speaker has got any of it."""
        return self._at > 0

    @property
    def rows(self) -> int:
        """Return how many rows the speaker has got."""
        return self._at

    @property
    def is_handed_over(self) -> bool:
        """Return whether the speaker has got everything."""
        return self._at == len(self._samples)

    def feed(self, output: AudioOutput, now_ns: int) -> int:
        """Hand over what is due and return how many rows were taken.

        Raises:
            LinkLost: the speaker has gone.
        """
        starts_ns = max(self.ends_ns, now_ns)
        due = max(0, (now_ns + LEAD_NS - starts_ns) * output.format.rate_hz // NS_PER_S)
        return self._hand_over(output, self._samples[self._at : self._at + due], starts_ns)

    def fade_out(self, output: AudioOutput, now_ns: int) -> int:
        """Hand over a short fade, which spares the listener a click, and return its rows.

        Raises:
            LinkLost: the speaker has gone.
        """
        rest = self._samples[self._at : self._at + round(_FADE_S * output.format.rate_hz)]
        fading = np.linspace(1.0, 0.0, len(rest))[:, None]
        samples = np.rint(rest * fading).astype(np.int16)
        return self._hand_over(output, samples, max(self.ends_ns, now_ns))

    def _hand_over(self, output: AudioOutput, samples: Samples, starts_ns: int) -> int:
        taken = output.write(samples)
        if taken:
            self._at += taken
            self.ends_ns = starts_ns + output.format.duration_ns(taken)
        return taken


class AudioPlayer:
    """Hold the speaker and what it plays; `format` is the speaker's, None before it was opened.

    `note` is called with what was handed over.
    """

    def __init__(self, open_output: OpenOutput, clock: Clock, note: Note) -> None:
        self.format: AudioFormat | None = None
        self.sounds_until_ns = 0
        self._note = note
        self._wave: Wave
        self._clock = clock
        self._open_output = open_output
        self._speaker: Reopening[AudioOutput] = Reopening("speaker", self._connect, clock)
        self._playback: Playback | None = None

    @property
    def away(self) -> str:
        """Return why nothing can be played; empty while the speaker is there."""
        return self._speaker.failure or ("" if self.format else "the speaker is not open yet")

    @property
    def has_begun(self) -> bool:
        """Return whether anything of the present sound was handed to the speaker."""
        return self._playback is not None and self._playback.has_begun

    @property
    def is_done(self) -> bool:
        """Return whether the present sound has sounded to its end."""
        playback = self._playback
        return playback is None or (
            playback.is_handed_over and self._clock.now_ns() >= playback.ends_ns
        )

    def play(self, sound: Prepared) -> None:
        """Play a sound from the next step on."""
        self._playback = Playback(sound.samples, self.sounds_until_ns)
        self._wave = sound.wave

    def step(self) -> None:
        """Hand the speaker what is due; open it where it is away. `away` tells of a loss."""
        now_ns = self._clock.now_ns()
        playback = self._playback
        if playback is None:
            self._speaker.poll(lambda _: 0, 0)
        elif self._speaker.poll(lambda output: playback.feed(output, now_ns), 0):
            self._note_played(playback)

    def cut(self) -> None:
        """Play no more of the present sound."""
        playback, self._playback = self._playback, None
        if playback is None or not playback.has_begun or self.away:
            return
        now_ns = self._clock.now_ns()
        if self._speaker.poll(lambda output: playback.fade_out(output, now_ns), 0):
            self._note_played(playback)

    def close(self) -> None:
        """Release the speaker; closing twice is allowed."""
        self._speaker.close()

    def _note_played(self, playback: Playback) -> None:
        assert self.format is not None, "rows were handed to an open speaker"
        self.sounds_until_ns = playback.ends_ns
        zero_ns = playback.ends_ns - self.format.duration_ns(playback.rows)
        self._note(self._wave, zero_ns, playback.ends_ns)

    def _connect(self) -> AudioOutput:
        output = self._open_output()
        self.format = output.format
        return output
