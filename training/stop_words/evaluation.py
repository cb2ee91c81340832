"""Judge the network on voices that it has not learnt; choose smoothing and thresholds by that."""

import json
import logging
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
import torch
from numpy.typing import NDArray

from training.stop_words.corpus import HELD, Clips, Said
from training.stop_words.export import trained
from training.stop_words.network import REACH, Scores
from training.stop_words.rooms import NoiseBank, Sound
from training.stop_words.settings import Settings
from training.voices.clip import RATE_HZ
from vla_deploy.speech.stop_words.features import HOP, STRIDE, WINDOW, log_mel

METRICS: Final = "metrics.json"
SNRS_DB: Final[dict[str, float | None]] = {"clean": None, "20": 20.0, "10": 10.0, "5": 5.0}
SMOOTHINGS: Final = (3, 5, 7, 9)
LONGEST_DELAY_S: Final = 0.42
GRID: Final = tuple(round(float(one), 3) for one in np.arange(0.3, 1.0, 0.005))
REFRACTORY_S: Final = 1.0
LATE_S: Final = 0.6
ALARMS_PER_HOUR: Final = {"high": 20.0, "normal": 8.0, "low": 3.0}
"""Of this talk, half of which is made to sound like a stop word: ordinary talk alarms a tenth."""
_BEFORE_S, _AFTER_S = 1.0, 0.9
_LOUDNESS, _HISS = 0.05, 3e-4
_LOG = logging.getLogger(__name__)
Scored = NDArray[np.float32]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Trial:
    """Hold a phrase in noise: scores of each moment near the word, and their times after it."""

    engine: str
    word: int
    snr: str
    times_s: NDArray[np.float64]
    scores: Scored


def evaluate(out: Path, models: Path, settings: Settings) -> None:
    """Write the figures beside the model.

    Raises:
        FileNotFoundError: nothing was trained yet, or nothing was spoken to judge by.
    """
    torch.set_num_threads(1)
    net = Scores(trained(out)).eval()
    random = np.random.default_rng([settings.seed, 3])
    others = Clips(out / "clips", HELD, "others")
    bank = NoiseBank(others, random)
    talk, hours = _talk(net, others, bank, settings, random)
    trials = list(_trials(net, Clips(out / "clips", HELD, "stops"), bank, settings, random))
    choices = [_choice(trials, talk, hours, smoothing) for smoothing in SMOOTHINGS]
    quick = [one for one in choices if one["at"]["normal"]["delay_p95_s"] <= LONGEST_DELAY_S]
    best = min(quick or choices, key=lambda one: float(one["at"]["normal"]["missed_mean"]))
    text = json.dumps(best, indent=2)
    (models / METRICS).write_text(text + "\n", encoding="utf-8")
    _LOG.info("smoothing %d: %s", best["smoothing"], json.dumps(best["at"]["normal"], indent=2))


def scores_of(net: Scores, sound: Sound) -> tuple[NDArray[np.float64], Scored]:
    """Return the time of each moment in seconds, and each word's score: (words, moments)."""
    frames = torch.from_numpy(log_mel(sound).T[None].copy())
    with torch.no_grad():
        scores: Scored = net(frames)[0, 1:].numpy()
    newest = np.arange(scores.shape[1]) * STRIDE + REACH - 1
    return (newest * HOP + WINDOW) / RATE_HZ, scores


def in_noise(
    said: Said, snr_db: float | None, bank: NoiseBank, random: np.random.Generator
) -> Sound:
    """Return a clip between seconds of nothing, with noise at a ratio to its own power."""
    before, after = round(_BEFORE_S * RATE_HZ) + REACH * HOP, round(_AFTER_S * RATE_HZ)
    values = said.samples.astype(np.float32)
    values *= _LOUDNESS / (np.sqrt(np.mean(values**2)) + 1e-6)
    sound = np.pad(values, (before, after))
    sound += np.float32(_HISS) * random.standard_normal(len(sound), np.float32)
    if snr_db is None:
        return sound
    noise = bank.take(len(sound), random)
    level = _LOUDNESS * 10.0 ** (-snr_db / 20.0) / (np.sqrt(np.mean(noise**2)) + 1e-6)
    return sound + np.float32(level) * noise


def _trials(
    net: Scores, stops: Clips, bank: NoiseBank, settings: Settings, random: np.random.Generator
) -> Sequence[Trial]:
    trials = []
    offset_s = _BEFORE_S + REACH * HOP / RATE_HZ
    picks = random.permutation(len(stops))[: settings.judged_stops]
    for number in picks:
        said = stops[int(number)]
        word, start_s, end_s = said.events[0]
        for snr, snr_db in SNRS_DB.items():
            times_s, scores = scores_of(net, in_noise(said, snr_db, bank, random))
            inside = (times_s > offset_s + start_s) & (times_s < offset_s + end_s + LATE_S)
            trials.append(
                Trial(
                    engine=said.voice.partition("/")[0],
                    word=int(word),
                    snr=snr,
                    times_s=times_s[inside] - offset_s - end_s,
                    scores=scores[:, inside],
                )
            )
    return trials


def _talk(
    net: Scores, others: Clips, bank: NoiseBank, settings: Settings, random: np.random.Generator
) -> tuple[list[Scored], float]:
    """Return the scores of clips of other talk, and how many hours they are."""
    spent_s, talk = 0.0, []
    while spent_s < 3600.0 * settings.judged_hours:
        said = others[int(random.integers(len(others)))]
        snr_db = (None, 20.0, 10.0)[int(random.integers(3))]
        talk.append(scores_of(net, in_noise(said, snr_db, bank, random))[1])
        spent_s += len(said.samples) / RATE_HZ
    return talk, spent_s / 3600.0


def _choice(
    trials: Sequence[Trial], talk: Sequence[Scored], hours: float, smoothing: int
) -> dict[str, Any]:
    """Return thresholds and figures with one smoothing."""
    peaks = [peak for scores in talk for peak in _peaks(smoothed(scores, smoothing))]
    thresholds = {name: _threshold(name, peaks, hours) for name in ALARMS_PER_HOUR}
    return {
        "smoothing": smoothing,
        "hours": hours,
        "thresholds": thresholds,
        "at": {
            name: _told(trials, peaks, hours, threshold, smoothing)
            for name, threshold in thresholds.items()
        },
    }


def smoothed(scores: Scored, count: int) -> Scored:
    """Return the best word's mean score over as many moments; those before the first count as 0."""
    padded = np.pad(scores, ((0, 0), (count - 1, 0)))
    mean: Scored = np.lib.stride_tricks.sliding_window_view(padded, count, axis=1).mean(axis=2)
    best: Scored = mean.max(axis=0)
    return best


def _peaks(best: Scored) -> list[float]:
    """Return the highest score of each second."""
    size = round(REFRACTORY_S * RATE_HZ / HOP / STRIDE)
    return [float(best[at : at + size].max()) for at in range(0, len(best), size)]


def _threshold(name: str, peaks: list[float], hours: float) -> float:
    """Return the lowest threshold of the grid with few enough false alarms."""
    for threshold in GRID:
        if sum(peak >= threshold for peak in peaks) <= ALARMS_PER_HOUR[name] * hours:
            return threshold
    return GRID[-1]


def _told(
    trials: Sequence[Trial], peaks: list[float], hours: float, threshold: float, smoothing: int
) -> dict[str, Any]:
    missed: dict[str, dict[str, list[bool]]] = defaultdict(lambda: defaultdict(list))
    delays_s = []
    for trial in trials:
        reached = np.flatnonzero(smoothed(trial.scores, smoothing) >= threshold)
        for group in ("all", trial.engine, f"word_{trial.word}"):
            missed[trial.snr][group].append(not len(reached))
        if len(reached):
            delays_s.append(float(trial.times_s[reached[0]]))
    ratios = {
        snr: {group: float(np.mean(flags)) for group, flags in groups.items()}
        for snr, groups in missed.items()
    }
    return {
        "threshold": threshold,
        "false_alarms_per_hour": sum(peak >= threshold for peak in peaks) / hours,
        "missed_mean": float(np.mean([ratios[snr]["all"] for snr in ("clean", "20", "10")])),
        "missed_ratio": ratios,
        "delay_p50_s": float(np.percentile(delays_s, 50)) if delays_s else LATE_S,
        "delay_p95_s": float(np.percentile(delays_s, 95)) if delays_s else LATE_S,
    }
