"""Play one sound at a time on a speaker that may come and go, and know what sounds when.

A sound is handed over bit by bit, so that the robot can fall silent at any moment.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

from drivers.audio.base import AudioFormat, AudioOutput, Samples
from drivers.audio.clip import Wave
from drivers.clock import NS_PER_S, Clock
from drivers.reopening import Reopening

LEAD_NS: Final = 3 * NS_PER_S // 20
"""How far ahead of its sounding the speaker gets sound: what is handed over cannot be taken back,
and a busy computer must not tear holes."""
OpenOutput = Callable[[], AudioOutput]
Note = Callable[[Wave, int, int], None]
"""Take a wave at 16 kHz, the time at which its first sample sounds, and until when it does."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PreparedSound:
    """Hold a sound as the speaker takes it, (n, channels), and as a wave at 16 kHz."""

    samples: Samples
    wave: Wave


class AudioPlayer:
    """Hold the speaker and what it plays; `format` is the speaker's, None before it was opened.

    `note` is called with what was handed over, which will have sounded at `sounds_until_ns`.
    """

    def __init__(self, open_output: OpenOutput, clock: Clock, note: Note) -> None:
        self.format: AudioFormat | None = None
        self.sounds_until_ns = 0
        self._note = note
        self._clock = clock
        self._open_output = open_output
        self._speaker: Reopening[AudioOutput] = Reopening("speaker", self._connect, clock)
        self._sound: PreparedSound | None = None
        self._at = 0

    @property
    def away(self) -> str:
        """Return why nothing can be played; empty while the speaker is there."""
        return self._speaker.failure or ("" if self.format else "the speaker is not open yet")

    @property
    def has_begun(self) -> bool:
        """Return whether anything of the present sound was handed to the speaker."""
        return self._sound is not None and self._at > 0

    @property
    def is_done(self) -> bool:
        """Return whether the present sound has sounded to its end."""
        sound = self._sound
        is_handed_over = sound is None or self._at == len(sound.samples)
        return is_handed_over and self._clock.now_ns() >= self.sounds_until_ns

    def play(self, sound: PreparedSound) -> None:
        """Play a sound from the next step on, after what the speaker still plays."""
        self._sound, self._at = sound, 0

    def step(self) -> None:
        """Hand the speaker what is due; open it where it is away. `away` tells of a loss."""
        self._speaker.poll(self._feed, 0)

    def cut(self) -> None:
        """Play no more of the present sound."""
        self._sound = None

    def close(self) -> None:
        """Release the speaker; closing twice is allowed."""
        self._speaker.close()

    def _feed(self, output: AudioOutput) -> int:
        if self._sound is None:
            return 0
        starts_ns = max(self.sounds_until_ns, self._clock.now_ns())
        ahead_ns = starts_ns - self._clock.now_ns()
        due = max(0, (LEAD_NS - ahead_ns) * output.format.rate_hz // NS_PER_S)
        taken = output.write(self._sound.samples[self._at : self._at + due])
        if taken:
            self._at += taken
            self.sounds_until_ns = starts_ns + output.format.duration_ns(taken)
            zero_ns = self.sounds_until_ns - output.format.duration_ns(self._at)
            self._note(self._sound.wave, zero_ns, self.sounds_until_ns)
        return taken

    def _connect(self) -> AudioOutput:
        output = self._open_output()
        self.format = output.format
        return output
