"""Speak the clips of the training and of the judging, and keep them on disk."""

import gzip
import json
import logging
from dataclasses import dataclass, replace
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from training.stop_words.cast import PARTS, CastPart, draw_style
from training.stop_words.examples import Examples
from training.stop_words.picking import pick
from training.stop_words.stop_texts import stop_texts
from training.stop_words.texts import WORDS, other_talk
from training.stop_words.timing import sounding, word_times
from training.voices.clip import RATE_HZ, SpokenClip, Wave
from training.voices.errors import SynthesisFailed
from training.voices.phones import NUMBERS

TRAIN, HELD, JUDGED = "train", "held", "judged"
SPLITS: Final = (TRAIN, HELD, JUDGED)
Samples = NDArray[np.int16]
_MARGIN: Final = RATE_HZ // 30
_FULL_SCALE: Final = 32_767.0
_LOG = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Said:
    """Hold one clip; `events` are rows of class (1 on), start and end in seconds.

    `phones` are rows of a phone's number and where it begins; none where the engine tells none.
    `is_ordinary` is false for stops, and for talk that was made to sound like one.
    """

    samples: Samples
    voice: str
    events: NDArray[np.float32]
    phones: NDArray[np.float32]
    is_ordinary: bool = False

    @property
    def wave(self) -> Wave:
        """Return the samples as a share of full scale."""
        return self.samples.astype(np.float32) / np.float32(_FULL_SCALE)


class Clips:
    """Hold many clips without a copy of their sound in memory."""

    def __init__(self, folder: Path, split: str, kind: str) -> None:
        """Open what `speak` has written.

        Raises:
            FileNotFoundError: nothing was spoken yet.
        """
        self._parts = []
        self._places: list[tuple[int, int]] = []
        self.voices: list[str] = []
        for part in sorted(folder.glob(f"{split}-{kind}-*.npy")):
            index = json.loads(part.with_suffix(".json").read_text(encoding="utf-8"))
            self._parts.append((np.load(part, mmap_mode="r"), index))
            self._places += [(len(self._parts) - 1, k) for k in range(len(index["voices"]))]
            self.voices += index["voices"]
        if not self._places:
            raise FileNotFoundError(f"{folder}: no clips of {split} {kind}; run the step speak")

    def __len__(self) -> int:
        return len(self._places)

    def __getitem__(self, number: int) -> Said:
        part, place = self._places[number]
        sound, index = self._parts[part]
        start, end = index["starts"][place], index["starts"][place + 1]
        return Said(
            samples=sound[start:end],
            voice=index["voices"][place],
            events=np.array(index["events"][place], np.float32).reshape(-1, 3),
            phones=np.array(index["phones"][place], np.float32).reshape(-1, 2),
            is_ordinary=index["ordinary"][place],
        )


def speak(folder: Path, seed: int, scale: float = 1.0) -> None:
    """Speak all clips; those of an engine that are on disk already stay.

    Raises:
        EngineMissing: an engine is not installed.
    """
    folder.mkdir(parents=True, exist_ok=True)
    for number, part in enumerate(PARTS):
        for split, kind, wanted in (
            (TRAIN, "stops", part.stops),
            (TRAIN, "others", part.others),
            (HELD, "stops", part.held_stops),
            (HELD, "others", part.held_others),
            (JUDGED, "stops", part.judged_stops),
            (JUDGED, "others", part.judged_others),
        ):
            path = folder / f"{split}-{kind}-{part.engine}.npy"
            count = round(wanted * scale)
            if path.with_suffix(".json").exists() or not count:
                continue
            random = np.random.default_rng([seed, number, SPLITS.index(split), kind == "stops"])
            _write(path, _clips(part, split, kind, count, random))
            _LOG.info("%s: %d clips", path.name, count)


def _clips(
    part: CastPart, split: str, kind: str, count: int, random: np.random.Generator
) -> list[Said]:
    voices = {TRAIN: part.voices, HELD: part.held_voices, JUDGED: part.judged_voices}[split]
    talk = other_talk(count, random, _lexicon(), _examples().draw)
    if kind == "stops":
        plain = [one.text for one in talk]
        texts = [(*one, False) for one in stop_texts(count, plain, random, timed=part.tells_times)]
    else:
        texts = [(one.text, "", False, one.is_ordinary) for one in talk]
    clips: list[Said] = []
    for text, word, is_last, is_ordinary in texts:
        voice = pick(voices, random)
        try:
            clip = part.speak(text, voice, draw_style(random))
        except SynthesisFailed as error:
            _LOG.warning("left out: %s", error)
            continue
        said = trimmed(clip, word, is_last=is_last)
        if said is not None:
            clips.append(replace(said, is_ordinary=is_ordinary))
    return clips


# Each engine's talk is drawn from both: they are read once.
@cache
def _examples() -> Examples:
    return Examples()


@cache
def _lexicon() -> list[str]:
    """Return the words of English that the package of one engine can read."""
    packed = files("hibari").joinpath("assets/lexicon_us_gold.json.gz").read_bytes()
    words = json.loads(gzip.decompress(packed))
    return [word for word in words if word.isalpha() and word.islower() and 2 < len(word) < 11]


def trimmed(clip: SpokenClip, word: str, *, is_last: bool) -> Said | None:
    """Cut the silence at both ends; None where nobody knows when the word was said."""
    first, last = sounding(clip.samples)
    low, high = max(0, first - _MARGIN), min(len(clip.samples), last + _MARGIN)
    times = word_times(clip, word, is_last=is_last) if word else []
    if word and not times:
        return None
    number = WORDS.index(word) + 1 if word else 0
    rows = np.array([(number, *each) for each in times], np.float32).reshape(-1, 3)
    rows[:, 1:] = np.clip(rows[:, 1:], 0.0, last / RATE_HZ) - low / RATE_HZ
    samples = np.rint(_FULL_SCALE * clip.samples[low:high]).astype(np.int16)
    began_s = [(NUMBERS[one.phone], max(0.0, one.began_s - low / RATE_HZ)) for one in clip.sounds]
    phones = np.array(began_s, np.float32).reshape(-1, 2)
    return Said(samples=samples, voice=f"{clip.engine}/{clip.voice}", events=rows, phones=phones)


def _write(path: Path, clips: list[Said]) -> None:
    """Write sound and index, the index last: it says that the part is whole."""
    starts = np.cumsum([0, *(len(clip.samples) for clip in clips)])
    np.save(path, np.concatenate([clip.samples for clip in clips]))
    index: dict[str, Any] = {
        "voices": [clip.voice for clip in clips],
        "starts": starts.tolist(),
        "events": [clip.events.tolist() for clip in clips],
        "phones": [clip.phones.tolist() for clip in clips],
        "ordinary": [clip.is_ordinary for clip in clips],
    }
    partial = path.with_suffix(".part")
    partial.write_text(json.dumps(index), encoding="utf-8")
    partial.rename(path.with_suffix(".json"))
