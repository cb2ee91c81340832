"""Measure the ears: where phrases begin and end, how soon their words are there, and what it costs.

Synthetic people of the twin's room speak over noise of several strengths; other sound, without a
person, must give no phrase. `end_to_text` is from the end of the last word at the microphone until
the words are there: the silence that ends a phrase, and what reading then still takes. It needs no
robot; without the profile's recogniser all but the reading is measured.
"""

import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np

from benchmarks.command import parser, show
from benchmarks.percentiles import spread_s
from drivers.audio.espeak import EspeakEngine
from drivers.clock import NS_PER_S, MonotonicClock
from platforms import Profile, load_profile
from sim_twin.sound.acoustics import Acoustics
from sim_twin.sound.talker import Talker, arrival
from vla_deploy.inference.memory_claims import resident_mb
from vla_deploy.inference.roles import ModelShelf
from vla_deploy.speech.asr_pipeline import AsrPipeline, HeardPhrase
from vla_deploy.speech.model_selection import SelectedRecogniser, select_recogniser
from vla_deploy.speech.recording import StreamClock, frames_of, open_hearing
from vla_deploy.speech.sound import RATE_HZ, Sound, duration_ns
from vla_deploy.supervisor.runs.runtime import default_base

VOICES: Final = ("en-gb", "en-us", "en-gb-scotland", "en-gb-x-rp", "en-029")
SENTENCES: Final = (
    "pick up the red cup and put it in the box",
    "go to the kitchen",
    "turn left ninety degrees",
    "what do you see",
    "put the blue ball on the table, please",
    "come here",
    "bring me the green bottle",
    "look at the book on the shelf",
)
PAUSE_S: Final = 1.6
NEAR_S: Final = 0.3
OTHER_SOUND_S: Final = 60.0
_AMPLITUDE: Final = 0.03


@dataclass(slots=True)
class SoundScene:
    """Hold sound, and the rows in which words are spoken."""

    sound: Sound
    words: list[tuple[int, int]] = field(default_factory=list)


@dataclass(slots=True)
class HeardScene:
    """Hold what was heard of a scene: each phrase with the stream's time at which it was told."""

    told: list[tuple[HeardPhrase, int]]
    cpu_s: float
    sound_s: float


def measure(profile: str = "jetson_orin_nano", rounds: int = 2) -> dict[str, Any]:
    """Return the figures."""
    before_mb = resident_mb()
    loaded = load_profile(profile)
    shelf = ModelShelf.of_base(default_base(), MonotonicClock())
    ears = select_recogniser(shelf, loaded, 0)
    report: dict[str, Any] = {
        "profile": profile,
        "model": None if ears.recogniser is None else ears.recogniser.model.manifest.name,
        "why_no_model": ears.why,
    }
    by_snr = {
        name: _spoken(ears, loaded, snr_db, rounds)
        for name, snr_db in (("quiet", None), ("20_db", 20.0), ("10_db", 10.0), ("5_db", 5.0))
    }
    report["speech"] = by_snr
    every = [one for part in by_snr.values() for one in part.pop("ends_s")]
    report |= spread_s("end_to_text", every)
    report["other_sound"] = {
        name: _other(ears, loaded, sound) for name, sound in _other_sounds().items()
    }
    report["memory_mb"] = resident_mb() - before_mb
    return report


def _spoken(
    ears: SelectedRecogniser, profile: Profile, snr_db: float | None, rounds: int
) -> dict[str, Any]:
    """Return how well and how soon phrases were found, and at what cost."""
    scene = _scene(snr_db, rounds)
    run = _hear(ears, profile, scene.sound)
    whole, parts, lags_s = 0, 0, []
    for first, last in scene.words:
        near = [one for one in run.told if _touches(one[0], first, last)]
        whole += len(near) == 1
        parts += max(0, len(near) - 1)
        if near:
            late = (max(told_ns for _, told_ns in near) - duration_ns(last)) / NS_PER_S
            lags_s.append(late + _read_s(near[-1][0], profile))
    return {
        "sentences": len(scene.words),
        "whole_ratio": whole / len(scene.words),
        "split": parts,
        "false_phrases": sum(
            not any(_touches(heard, *words) for words in scene.words) for heard, _ in run.told
        ),
        "end_to_text_p50_s": float(np.percentile(lags_s, 50)),
        "end_to_text_p95_s": float(np.percentile(lags_s, 95)),
        "real_time_factor": run.cpu_s / run.sound_s,
        "ends_s": lags_s,
    }


def _read_s(heard: HeardPhrase, profile: Profile) -> float:
    """Return what reading still takes after the phrase has ended.

    On the robot it begins in advance, in the pause; here it takes no time of the stream.
    """
    if heard.transcript is None:
        return 0.0
    in_advance_s = 0.4 * profile.speech.end_silence_s
    return max(0.0, heard.transcript.took_s - in_advance_s)


def _scene(snr_db: float | None, rounds: int) -> SoundScene:
    draw = np.random.default_rng(7)
    parts: list[Sound] = [np.zeros(2 * RATE_HZ, np.float32)]
    words, row = [], 2 * RATE_HZ
    for number in range(rounds * len(SENTENCES)):
        engine = EspeakEngine(voice=VOICES[number % len(VOICES)])
        text = SENTENCES[number % len(SENTENCES)]
        heard = arrival(text, Talker(engine=engine), RATE_HZ, Acoustics(), seed=number)
        words.append((row + heard.words[0], row + heard.words[1]))
        for part in (heard.sound.wave, np.zeros(round(PAUSE_S * RATE_HZ), np.float32)):
            parts.append(part.astype(np.float32))
            row += len(part)
    sound = np.concatenate(parts)
    level = float(np.sqrt(np.mean(np.concatenate([sound[a:b] for a, b in words]) ** 2)))
    noise = 10.0 ** (-(60.0 if snr_db is None else snr_db) / 20.0) * level
    sound = sound + noise * draw.standard_normal(len(sound)).astype(np.float32)
    return SoundScene(sound=sound.astype(np.float32), words=words)


def _other_sounds() -> dict[str, Sound]:
    draw = np.random.default_rng(11)
    count = round(OTHER_SOUND_S * RATE_HZ)
    time_s = np.arange(count) / RATE_HZ
    white = _AMPLITUDE * draw.standard_normal(count)
    chords = np.zeros(count)
    for number in range(round(OTHER_SOUND_S)):
        root = 220.0 * 2.0 ** (int(draw.integers(0, 12)) / 12.0)
        rows = slice(number * RATE_HZ, (number + 1) * RATE_HZ)
        fade = np.exp(-2.0 * (time_s[rows] % 1.0))
        for ratio in (1.0, 1.26, 1.5, 2.0):
            chords[rows] += _AMPLITUDE * fade * np.sin(2 * np.pi * root * ratio * time_s[rows])
    hum = _AMPLITUDE * np.sin(2 * np.pi * 50.0 * time_s) + 0.1 * white
    knocks = 0.02 * white
    for row in draw.integers(0, count - 800, 80):
        knocks[row : row + 800] += 0.4 * draw.standard_normal(800) * np.exp(-np.arange(800) / 100)
    named = {"white_noise": white, "music": chords, "hum": hum, "knocks": knocks}
    return {name: sound.astype(np.float32) for name, sound in named.items()}


def _other(ears: SelectedRecogniser, profile: Profile, sound: Sound) -> dict[str, Any]:
    run = _hear(ears, profile, sound)
    accepted = sum(heard.judgement.verdict != "rejected" for heard, _ in run.told)
    return {
        "phrases_per_hour": 3600.0 * len(run.told) / run.sound_s,
        "accepted": accepted,
        "real_time_factor": run.cpu_s / run.sound_s,
    }


def _hear(ears: SelectedRecogniser, profile: Profile, sound: Sound) -> HeardScene:
    """Let a stream be heard as fast as it can be."""
    stream, cpu = StreamClock(), MonotonicClock()
    hearing = open_hearing(ears, profile, stream)
    began_ns = cpu.now_ns()
    told = list(_told(hearing, stream, sound))
    took_s = (cpu.now_ns() - began_ns) / NS_PER_S
    return HeardScene(told=told, cpu_s=took_s, sound_s=len(sound) / RATE_HZ)


def _told(
    hearing: AsrPipeline, clock: StreamClock, sound: Sound
) -> Iterator[tuple[HeardPhrase, int]]:
    for frame in frames_of(sound):
        clock.ns = frame.end_ns
        hearing.feed(frame, None)
        for heard in hearing.heard():
            yield heard, clock.ns


def _touches(heard: HeardPhrase, first: int, last: int) -> bool:
    near_ns = round(NEAR_S * NS_PER_S)
    return (
        heard.phrase.ended_ns > duration_ns(first) - near_ns
        and heard.phrase.began_ns < duration_ns(last) + near_ns
    )


def main(argv: Sequence[str] | None = None) -> int:
    """Print the figures."""
    arguments = parser("speech --part ears", __doc__)
    arguments.add_argument("--profile", default="jetson_orin_nano", help="whose model and settings")
    arguments.add_argument("--rounds", type=int, default=2, help="of eight sentences (default: 2)")
    given = arguments.parse_args(argv)
    show(measure(given.profile, given.rounds), as_json=given.json)
    return 0


if __name__ == "__main__":
    sys.exit(main())
