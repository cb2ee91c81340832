"""Play one sound at a time on a speaker that may come and go, and know what sounds when."""

from collections.abc import Callable
from dataclasses import dataclass

from drivers.audio.base import AudioFormat, AudioOutput, Samples
from drivers.clock import Clock
from drivers.reopening import Reopening
from vla_deploy.speech.voice.clip import Wave
from vla_deploy.speech.voice.playback import Playback

OpenOutput = Callable[[], AudioOutput]


Note = Callable[[Wave, int, int], None]
"""Take a wave at 16 kHz, the time at which its first sample sounds, and until when it does."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Prepared:
    """Hold a sound as the speaker takes it, (n, channels), and as a wave at 16 kHz."""

    samples: Samples
    wave: Wave


class Mouth:
    """Hold the speaker and what it plays; `format` is the speaker's, None before it was opened.

    `note` is told what was handed over.
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
        """Tell whether anything of the present sound was handed to the speaker."""
        return self._playback is not None and self._playback.has_begun

    @property
    def is_done(self) -> bool:
        """Tell whether the present sound has sounded to its end."""
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
            self._told(playback)

    def cut(self) -> None:
        """Play no more of the present sound."""
        playback, self._playback = self._playback, None
        if playback is None or not playback.has_begun or self.away:
            return
        now_ns = self._clock.now_ns()
        if self._speaker.poll(lambda output: playback.fade_out(output, now_ns), 0):
            self._told(playback)

    def close(self) -> None:
        """Release the speaker; closing twice is allowed."""
        self._speaker.close()

    def _told(self, playback: Playback) -> None:
        assert self.format is not None, "rows were handed to an open speaker"
        self.sounds_until_ns = playback.ends_ns
        zero_ns = playback.ends_ns - self.format.duration_ns(playback.rows)
        self._note(self._wave, zero_ns, playback.ends_ns)

    def _connect(self) -> AudioOutput:
        output = self._open_output()
        self.format = output.format
        return output
