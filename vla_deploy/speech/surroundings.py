"""Know what the room sounds like when nobody speaks: how loud it is, and whether music plays."""

from typing import Final

import numpy as np

from vla_deploy.speech.sound import RATE_HZ, SILENCE_DB, Sound
from vla_deploy.speech.voice_activity import FRAME, FRAME_S

START_DB: Final = -60.0
MUSIC_FLATNESS: Final = 0.08
"""Below this spectral flatness a frame has a pitch, which noise and babble lack."""
MUSIC_SHARE: Final = 0.6
_ABOVE_SILENCE_DB: Final = 20.0
_RISE_DB_S: Final = 3.0
_FALL_DB_S: Final = 30.0
_MUSIC_S: Final = 3.0
_WINDOW: Final = np.hanning(FRAME).astype(np.float32)
_BAND: Final = slice(round(100 * FRAME / RATE_HZ), round(4_000 * FRAME / RATE_HZ))


class NoiseFloor:
    """Follow the level of frames without a voice: down at once, up slowly, so a word is no floor.

    A voice holds it where it is; a noise that goes on is the floor after some seconds.
    """

    def __init__(self) -> None:
        self.level_db = START_DB

    def note(self, level_db: float, *, is_voice: bool) -> None:
        """Take the level of the next frame."""
        if is_voice and level_db > self.level_db:
            return
        step = level_db - self.level_db
        most = (_RISE_DB_S if step > 0 else _FALL_DB_S) * FRAME_S
        self.level_db = max(SILENCE_DB, self.level_db + float(np.clip(step, -most, most)))


class Music:
    """Notice sound that has a pitch for seconds on end and is no voice."""

    def __init__(self) -> None:
        self.share = 0.0

    @property
    def plays(self) -> bool:
        """Tell whether music, or another sound with a steady pitch, is heard."""
        return self.share > MUSIC_SHARE

    def note(self, samples: Sound, level_db: float, voice: float) -> None:
        """Take the next frame, its level, and how probably it holds a voice."""
        is_loud = level_db > SILENCE_DB + _ABOVE_SILENCE_DB
        is_music = is_loud and voice < 0.5 and flatness(samples) < MUSIC_FLATNESS
        self.share += (float(is_music) - self.share) * FRAME_S / _MUSIC_S


def flatness(samples: Sound) -> float:
    """Return the spectral flatness of a frame up to 4 kHz: 1 for white noise, near 0 for a tone."""
    power = np.square(np.abs(np.fft.rfft(samples * _WINDOW)[_BAND])) + 1e-12
    return float(np.exp(np.mean(np.log(power))) / np.mean(power))
