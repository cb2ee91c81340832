"""Find when a stop word was said in a clip: by its sounds, or by where the clip falls silent."""

from collections.abc import Iterator, Mapping
from typing import Final

import numpy as np

from training.voices.clip import RATE_HZ, SpokenClip, Wave

_SOUNDS: Final[Mapping[str, tuple[tuple[str, ...], ...]]] = {
    "stop": (("s", "t", "aa", "p"), ("s", "t", "ao", "p")),
    "halt": (("hh", "ao", "l", "t"), ("hh", "aa", "l", "t")),
    "freeze": (("f", "r", "iy", "z"),),
}
_QUIET_RATIO: Final = 0.03
_WORD_S: Final = 0.45
_FIRST_WORD_S: Final = 0.35
"""What comes next cuts it short."""


def word_times(clip: SpokenClip, word: str, *, is_last: bool) -> list[tuple[float, float]]:
    """Return start and end of each time that a word was said, in seconds; empty if unknown.

    Where the engine tells no sounds, a word that comes once begins or ends with the clip's sound.
    """
    count = clip.text.lower().count(word)
    found = list(_by_sounds(clip, word))
    if len(found) == count:
        return [(start_s, _heard_until(clip.samples, start_s, end_s)) for start_s, end_s in found]
    if clip.sounds or not can_be_timed(clip.text, word, is_last=is_last):
        return []
    start_s, end_s = (edge / RATE_HZ for edge in sounding(clip.samples))
    if not is_last:
        return [(start_s, start_s + _FIRST_WORD_S)]
    # Said slowly it takes longer than usual: as large a part of the sound as of the letters.
    slow_s = (end_s - start_s) * len(word) / sum(map(str.isalpha, clip.text))
    return [(max(0.0, end_s - max(_WORD_S, slow_s)), end_s)]


def can_be_timed(text: str, word: str, *, is_last: bool) -> bool:
    """Return whether a word can be found by where a clip falls silent: it comes once, at an end."""
    said = text.lower()
    return said.count(word) == 1 and (is_last or said.startswith(word))


def sounding(samples: Wave) -> tuple[int, int]:
    """Return where sound begins and ends, by its level in hundredths of a second."""
    step = RATE_HZ // 100
    whole = samples[: len(samples) // step * step].reshape(-1, step)
    level = np.sqrt(np.mean(whole**2, axis=1))
    loud = np.flatnonzero(level > _QUIET_RATIO * level.max(initial=1e-6))
    return (int(loud[0]) * step, (int(loud[-1]) + 1) * step) if len(loud) else (0, len(samples))


def _heard_until(samples: Wave, start_s: float, end_s: float) -> float:
    """Return the end without the pause before what comes next."""
    start, end = round(start_s * RATE_HZ), round(end_s * RATE_HZ)
    heard_s = (start + sounding(samples[start:end])[1]) / RATE_HZ
    return min(end_s, heard_s)


def _by_sounds(clip: SpokenClip, word: str) -> Iterator[tuple[float, float]]:
    phones = [sound.phone for sound in clip.sounds]
    began_s = [*(sound.began_s for sound in clip.sounds), clip.duration_s]
    for spelling in _SOUNDS[word]:
        for k in range(len(phones) - len(spelling) + 1):
            if tuple(phones[k : k + len(spelling)]) == spelling:
                yield began_s[k], began_s[k + len(spelling)]
