"""Hand one sound to a speaker bit by bit, so that it can fall silent at any moment."""

from typing import Final

import numpy as np

from drivers.audio.base import AudioOutput, Samples
from drivers.clock import NS_PER_S

LEAD_NS: Final = 3 * NS_PER_S // 20
"""How far ahead of its sounding the speaker gets sound: what is handed over cannot be taken back,
and a busy computer must not tear holes."""
_FADE_S: Final = 0.008


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
        """Tell whether the speaker has got any of it."""
        return self._at > 0

    @property
    def rows(self) -> int:
        """Return how many rows the speaker has got."""
        return self._at

    @property
    def is_handed_over(self) -> bool:
        """Tell whether the speaker has got everything."""
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
