"""Measure the spoken stop: what is missed, what alarms by mistake, and how soon the button is hit.

Phrases with a stop word are said by voices of every installed engine, in noise and in rooms, at
10 dB also a moment after the voice has said something else; and other talk by the same voices. All
goes into what listens on board: the spotter as the profile wants it, and the recogniser, whose
words press the button too as soon as it has read them; `stop_curve` is what other thresholds of the
spotter alone would miss and take for stops. A delay is from the end of the word to the
end of the block of sound in which it was told, and what the computer took for that block. `latch`
does it with the whole way: a person in the twin's room says it while an arm moves, and physics
tells when all stands still.
"""

import sys
from collections import defaultdict
from collections.abc import Collection, Mapping, Sequence
from itertools import islice
from typing import Any, Final

import numpy as np

from benchmarks.command import parser, show
from benchmarks.speech_stop_latch import latch
from benchmarks.speech_stop_listening import (
    SPOTTER,
    WORDS,
    Delay,
    StopListening,
    delay_figures,
)
from benchmarks.speech_stop_talk import Voices, other_talk, phrases, words_alike
from training.voices.clip import RATE_HZ, SpokenClip, Wave
from training.voices.mixing import at_level, at_snr
from training.voices.noises import KINDS, noise
from training.voices.rooms import draw_room, in_room
from vla_deploy.speech.sound import FRAME, NOTHING

SNRS_DB: Final[Mapping[str, float | None]] = {"clean": None, "20db": 20.0, "10db": 10.0, "5db": 5.0}
CASES: Final[Mapping[str, tuple[float | None, bool]]] = {
    **{name: (snr_db, False) for name, snr_db in SNRS_DB.items()},
    "10db_after_talk": (SNRS_DB["10db"], True),
}
"""How loud the noise is, and whether the voice has just said something else."""
_TALK_SNRS: Final = ("clean", "clean", "20db", "10db")
TOO_LATE_S: Final = 1.0
_LEVEL_DB: Final = -26.0
_HISS: Final = 2e-4
_BEFORE_S, _AFTER_S = 0.8, 1.2
_SECOND: Final = RATE_HZ // FRAME
_THRESHOLDS: Final = (0.5, 0.55, 0.6, 0.65, 0.7, 0.75, 0.8, 0.85)


class _Curve:
    """Follow what the spotter alone would miss, and take for a stop, at other thresholds."""

    def __init__(self) -> None:
        self._stops: dict[str, list[float]] = defaultdict(list)
        self._talk: list[float] = []
        self._talked_h = 1e-9

    def add_stop(self, case: str, scores: Sequence[tuple[float, float]], start_s: float) -> None:
        """Take the scores of a phrase whose stop word begins at `start_s`."""
        self._stops[case].append(max(score for at_s, score in scores if at_s > start_s))

    def add_talk(self, scores: Sequence[tuple[float, float]], duration_s: float) -> None:
        """Take the scores of other talk: after an alarm the spotter is silent for a second."""
        values = [score for _, score in scores]
        self._talk += [max(values[at : at + _SECOND]) for at in range(0, len(values), _SECOND)]
        self._talked_h += duration_s / 3600.0

    def rows(self) -> list[dict[str, float]]:
        """Return a row for each threshold."""
        return [
            {
                "threshold": threshold,
                **{
                    f"missed_ratio_{case}": float(np.mean([one < threshold for one in highest]))
                    for case, highest in self._stops.items()
                },
                "false_alarms_per_hour": sum(one >= threshold for one in self._talk)
                / self._talked_h,
            }
            for threshold in _THRESHOLDS
        ]


def measure(
    clips: int = 40,
    hours: float = 0.5,
    seed: int = 0,
    latches: int = 3,
    misses: bool = False,
    cases: Collection[str] = tuple(CASES),
) -> dict[str, Any]:
    """Return the figures; `clips` are phrases by each engine, `hours` those of other talk.

    The phrases are said in some of CASES.

    Raises:
        InferenceError: the model cannot be opened.
        EngineMissing: not even eSpeak is installed.
    """
    random = np.random.default_rng(seed)
    voices, ear = Voices(), StopListening()
    curve = _Curve()
    stops = _stops(voices, ear, clips, cases, random, curve)
    talk = _talk(voices, ear, hours, random, curve) | _alike(voices, ear, 3 * clips, random)
    if not misses:
        stops.pop("stop_misses")
        talk.pop("stop_false_alarms")
        talk.pop("stop_alike_alarms")
    return {
        "stop_engines": sorted(voices.engines),
        "stop_engines_missing": voices.missing,
        "stop_threshold": ear.threshold,
        "stop_curve": curve.rows(),
        **stops,
        **talk,
        "stop_no_words": ear.why_no_words,
        "stop_cpu_ratio": ear.busy_s[SPOTTER] / ear.heard_s,
        "stop_words_cpu_ratio": ear.busy_s[WORDS] / ear.heard_s,
        **latch(latches),
    }


def _stops(
    voices: Voices,
    ear: StopListening,
    clips: int,
    cases: Collection[str],
    random: np.random.Generator,
    curve: "_Curve",
) -> dict[str, Any]:
    missed: dict[str, dict[str, list[bool]]] = defaultdict(lambda: defaultdict(list))
    delays: list[Delay] = []
    misses: list[str] = []
    for engine in voices.engines:
        for clip, (start_s, end_s) in phrases(voices, engine, clips, random):
            before = voices.before(clip, random)
            for name, (snr_db, follows_talk) in CASES.items():
                drawn = _apart(random)
                if name not in cases:
                    continue
                first = before if follows_talk else NOTHING
                samples, later_s = np.concatenate((first, clip.samples)), len(first) / RATE_HZ
                sound = _around(samples, snr_db, drawn)
                by = _delays(ear, sound, later_s + start_s, later_s + end_s)
                curve.add_stop(name, ear.scores, _BEFORE_S + later_s + start_s)
                for group in (engine, "all"):
                    missed[name][group].append(not by)
                for one in (SPOTTER, WORDS):
                    missed[name][one].append(one not in by)
                if by:
                    delays.append(min(by.values(), key=sum))
                else:
                    misses.append(f"{name}, {engine} {clip.voice}: {clip.text}")
    return {
        "stop_phrases": max((len(some["all"]) for some in missed.values()), default=0),
        **{f"stop_missed_ratio_{name}": float(np.mean(missed[name]["all"])) for name in missed},
        **{
            f"stop_missed_by_{one}_ratio_{name}": float(np.mean(missed[name][one]))
            for one in (SPOTTER, WORDS)
            for name in missed
        },
        "stop_missed_by_engine_10db": {
            engine: float(np.mean(some))
            for engine, some in missed.get("10db", {}).items()
            if engine in voices.engines
        },
        **delay_figures(delays),
        "stop_misses": misses,
    }


def _delays(ear: StopListening, sound: Wave, start_s: float, end_s: float) -> dict[str, Delay]:
    """Return how long after the word each listener hit the button, unless far too late."""
    found: dict[str, Delay] = {}
    for alarm in ear.alarms(sound):
        late_s = alarm.at_s - (_BEFORE_S + end_s)
        if alarm.at_s > _BEFORE_S + start_s and late_s < TOO_LATE_S:
            found.setdefault(alarm.by, Delay(max(0.0, late_s), alarm.computed_s))
    return found


def _apart(random: np.random.Generator) -> np.random.Generator:
    """Return what draws for one sound: what is drawn later must not depend on how long that is."""
    return random.spawn(1)[0]


def _around(samples: Wave, snr_db: float | None, random: np.random.Generator) -> Wave:
    """Return speech with a quiet moment at each end, in noise, every other time in a room."""
    before, after = round(_BEFORE_S * RATE_HZ), round(_AFTER_S * RATE_HZ)
    sound = np.pad(at_level(samples, _LEVEL_DB), (before, after))
    if random.random() < 0.5:
        sound = in_room(sound, draw_room(random))
    if snr_db is not None:
        kind = str(random.choice(list(KINDS)))
        sound = at_snr(sound, noise(kind, len(sound), random), snr_db)
    return sound + np.float32(_HISS) * random.standard_normal(len(sound), np.float32)


def _talk(
    voices: Voices,
    ear: StopListening,
    hours: float,
    random: np.random.Generator,
    curve: "_Curve",
) -> dict[str, Any]:
    """Let people talk of other things, half of the time in noise at 20 or 10 dB."""
    alarms: dict[str, list[str]] = {name: [] for name in _TALK_SNRS}
    talked_h = dict.fromkeys(_TALK_SNRS, 1e-9)
    for clip in other_talk(voices, random):
        if sum(talked_h.values()) >= hours:
            break
        name = _drawn(random)
        alarms[name] += _alarms(ear, clip, SNRS_DB[name], random)
        talked_h[name] += clip.duration_s / 3600.0
        curve.add_talk(ear.scores, clip.duration_s)
    count, talked = sum(map(len, alarms.values())), sum(talked_h.values())
    return {
        "stop_talk_hours": talked,
        "stop_false_alarms_per_hour": count / talked,
        **{
            f"stop_false_alarms_per_hour_{name}": len(alarms[name]) / talked_h[name]
            for name in alarms
        },
        "stop_false_alarms": [f"{name}: {one}" for name, some in alarms.items() for one in some],
    }


def _alike(
    voices: Voices, ear: StopListening, count: int, random: np.random.Generator
) -> dict[str, Any]:
    """Let people say what was made to sound like a stop word, in the same noise."""
    clips = islice(words_alike(voices, random), count)
    alarms = [_alarms(ear, clip, SNRS_DB[_drawn(random)], random) for clip in clips]
    return {
        "stop_alike_sentences": count,
        "stop_alike_alarmed_ratio": float(np.mean([bool(found) for found in alarms])),
        "stop_alike_alarms": [one for found in alarms for one in found],
    }


def _drawn(random: np.random.Generator) -> str:
    return _TALK_SNRS[int(random.integers(len(_TALK_SNRS)))]


def _alarms(
    ear: StopListening, clip: SpokenClip, snr_db: float | None, random: np.random.Generator
) -> list[str]:
    sound = _around(clip.samples, snr_db, _apart(random))
    found = ear.alarms(sound[: -RATE_HZ // 2])
    return [f"{one.word} by {one.by}, {clip.engine} {clip.voice}: {clip.text}" for one in found]


def main(argv: Sequence[str] | None = None) -> int:
    """Print the figures."""
    arguments = parser("speech_stop", __doc__)
    arguments.add_argument("--clips", type=int, default=40, help="phrases by each engine")
    arguments.add_argument("--hours", type=float, default=0.5, help="of other talk")
    arguments.add_argument("--latches", type=int, default=3, help="stops of a moving robot")
    arguments.add_argument("--seed", type=int, default=0)
    arguments.add_argument("--misses", action="store_true", help="list what went wrong")
    arguments.add_argument("--case", action="append", choices=CASES, help="all, if none is named")
    given = arguments.parse_args(argv)
    figures = measure(
        given.clips,
        given.hours,
        given.seed,
        given.latches,
        given.misses,
        given.case or tuple(CASES),
    )
    show(figures, as_json=given.json)
    return 0


if __name__ == "__main__":
    sys.exit(main())
