"""Judge the network on voices that it has not learnt.

Smoothing and thresholds are chosen by the held voices: the latter by how often ordinary talk, which
is not made to sound like a stop word, sets the network off. Then, once, the judged voices tell how
good it is: nothing is chosen by them. What is judged is the exported file.
"""

import json
import logging
from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, TypeVar

import numpy as np
import onnx
from numpy.typing import NDArray

from training.stop_words.corpus import HELD, JUDGED, Clips, Said
from training.stop_words.export import FILE, INPUT
from training.stop_words.network import REACH
from training.stop_words.rooms import NoiseBank, Sound
from training.stop_words.settings import StopWordSettings
from training.voices import kokoro
from training.voices.clip import RATE_HZ
from vla_deploy.inference.runtime import InferenceSession, SessionOptions
from vla_deploy.speech.stop_words.features import HOP, STRIDE, WINDOW, log_mel

METRICS: Final = "metrics.json"
SNRS_DB: Final[dict[str, float | None]] = {"clean": None, "20": 20.0, "10": 10.0, "5": 5.0}
SMOOTHINGS: Final = (3, 5, 7, 9)
LONGEST_DELAY_S: Final = 0.42
GRID: Final = tuple(round(float(one), 3) for one in np.arange(0.3, 1.0, 0.005))
REFRACTORY_S: Final = 1.0
LATE_S: Final = 0.6
ALARMS_PER_HOUR: Final = {"high": 8.0, "normal": 3.0, "low": 1.0}
"""Of the held voices' ordinary talk."""
TALK_SNRS_DB: Final = (None, 20.0, 10.0)
CURVE: Final = tuple(round(float(one), 2) for one in np.arange(0.4, 1.0, 0.05))
ALL: Final = "all"
ALL_BUT_KOKORO: Final = "all_but_kokoro"
ORDINARY, ALIKE = "ordinary", "alike"
"""Talk as people talk, and talk that was made to sound like a stop word, or chosen for it."""
_BEFORE_S, _AFTER_S = 1.0, 0.9
_LOUDNESS, _HISS = 0.05, 3e-4
_LOG = logging.getLogger(__name__)
Scored = NDArray[np.float32]
_T = TypeVar("_T")
ByKind = dict[str, dict[str, _T]]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class WordTrial:
    """Hold a phrase in noise: scores of each moment near the word, and their times after it."""

    engine: str
    word: int
    snr: str
    times_s: NDArray[np.float64]
    scores: Scored


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Talk:
    """Hold the scores of a clip of other talk, which is ORDINARY or ALIKE."""

    engine: str
    kind: str
    duration_s: float
    scores: Scored


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Heard:
    """Hold all that the network heard of some voices."""

    trials: Sequence[WordTrial]
    talk: Sequence[Talk]

    @property
    def hours(self) -> ByKind[float]:
        """Return how much other talk there is, of each kind and group."""
        hours: ByKind[float] = {kind: defaultdict(float) for kind in (ORDINARY, ALIKE)}
        for one in self.talk:
            for group in _groups(one.engine):
                hours[one.kind][group] += one.duration_s / 3600.0
        return hours


def evaluate(out: Path, models: Path, settings: StopWordSettings) -> None:
    """Choose by the held voices, and write what they tell beside the model.

    Raises:
        FileNotFoundError: nothing was trained yet, or nothing was spoken to judge by.
    """
    heard = heard_by(models / FILE, out, HELD, settings)
    best = chosen(heard)
    _write(models, best)
    _LOG.info("smoothing %d: %s", best["smoothing"], json.dumps(best["at"]["low"], indent=2))


def chosen(heard: Heard) -> dict[str, Any]:
    """Return the smoothing and the thresholds that serve best, and what they cost."""
    choices = [_choice(heard, smoothing) for smoothing in SMOOTHINGS]
    quick = [one for one in choices if one["at"]["low"]["delay_p95_s"] <= LONGEST_DELAY_S]
    return min(quick or choices, key=lambda one: float(one["at"]["low"]["missed_mean"]))


def judge(out: Path, models: Path, settings: StopWordSettings) -> None:
    """Add what the judged voices tell of a model whose thresholds are chosen.

    Raises:
        FileNotFoundError: the model was not evaluated yet, or nothing was spoken to judge by.
    """
    metrics = json.loads((models / METRICS).read_text(encoding="utf-8"))
    heard = heard_by(models / FILE, out, JUDGED, settings)
    told = _figures(heard, metrics["thresholds"], metrics["smoothing"])
    _write(models, metrics | {"judged": told})
    _LOG.info("judged: %s", json.dumps(told["at"]["low"], indent=2))


def _write(models: Path, metrics: dict[str, Any]) -> None:
    text = json.dumps(metrics, indent=2)
    (models / METRICS).write_text(text + "\n", encoding="utf-8")


def heard_by(file: Path, out: Path, split: str, settings: StopWordSettings) -> Heard:
    """Let an exported network hear phrases and other talk of the voices of one split.

    Raises:
        FileNotFoundError: there is no such network, or nothing was spoken to judge by.
    """
    net = _opened(file)
    random = np.random.default_rng([settings.seed, 3])
    others = Clips(out / "clips", split, "others")
    bank = NoiseBank(others, random)
    talk = _talk(net, others, bank, settings, random)
    stops = Clips(out / "clips", split, "stops")
    return Heard(talk=talk, trials=_trials(net, stops, bank, settings, random))


def _opened(file: Path) -> InferenceSession:
    """Open a network for clips of any length: it has no padding, so that it says the same."""
    model = onnx.load(file)
    for value in (*model.graph.input, *model.graph.output):
        value.type.tensor_type.shape.dim[2].dim_param = value.name
    options = SessionOptions()
    options.intra_op_num_threads = 1
    return InferenceSession(model.SerializeToString(), options)


def scores_of(net: InferenceSession, sound: Sound) -> tuple[NDArray[np.float64], Scored]:
    """Return the time of each moment in seconds, and each word's score: (words, moments)."""
    scores: Scored = net.run(None, {INPUT: log_mel(sound).T[None]})[0][0, 1:]
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
    net: InferenceSession,
    stops: Clips,
    bank: NoiseBank,
    settings: StopWordSettings,
    random: np.random.Generator,
) -> Sequence[WordTrial]:
    trials = []
    offset_s = _BEFORE_S + REACH * HOP / RATE_HZ
    for number in random.permutation(len(stops))[: settings.judged_stops]:
        said = stops[int(number)]
        word, start_s, end_s = said.events[0]
        for snr, snr_db in SNRS_DB.items():
            times_s, scores = scores_of(net, in_noise(said, snr_db, bank, random))
            inside = (times_s > offset_s + start_s) & (times_s < offset_s + end_s + LATE_S)
            trials.append(
                WordTrial(
                    engine=_engine(said),
                    word=int(word),
                    snr=snr,
                    times_s=times_s[inside] - offset_s - end_s,
                    scores=scores[:, inside],
                )
            )
    return trials


def _talk(
    net: InferenceSession,
    others: Clips,
    bank: NoiseBank,
    settings: StopWordSettings,
    random: np.random.Generator,
) -> list[Talk]:
    """Return the scores of clips of other talk, each clip in each noise."""
    spent_s = 0.0
    talk: list[Talk] = []
    for number in random.permutation(len(others)):
        said = others[int(number)]
        for snr_db in TALK_SNRS_DB:
            duration_s = len(said.samples) / RATE_HZ
            scores = scores_of(net, in_noise(said, snr_db, bank, random))[1]
            kind = ORDINARY if said.is_ordinary else ALIKE
            talk.append(Talk(engine=_engine(said), kind=kind, duration_s=duration_s, scores=scores))
            spent_s += duration_s
        if spent_s >= 3600.0 * settings.judged_hours:
            break
    return talk


def _engine(said: Said) -> str:
    return said.voice.partition("/")[0]


def _groups(engine: str) -> tuple[str, ...]:
    """Return the groups of clips that one engine's belong to."""
    return (ALL, engine) if engine == kokoro.ENGINE else (ALL, engine, ALL_BUT_KOKORO)


def _choice(heard: Heard, smoothing: int) -> dict[str, Any]:
    """Return thresholds and figures with one smoothing."""
    peaks, hours = _peaks(heard, smoothing)[ORDINARY][ALL], heard.hours[ORDINARY][ALL]
    thresholds = {name: _threshold(peaks, most * hours) for name, most in ALARMS_PER_HOUR.items()}
    return {
        "smoothing": smoothing,
        "thresholds": thresholds,
        **_figures(heard, thresholds, smoothing),
    }


def _figures(heard: Heard, thresholds: Mapping[str, float], smoothing: int) -> dict[str, Any]:
    """Return what is told at each threshold, and the curve of misses against alarms."""
    peaks = _peaks(heard, smoothing)

    def told(threshold: float) -> dict[str, Any]:
        return _told(heard, peaks, threshold, smoothing)

    return {
        "hours": heard.hours,
        "at": {name: told(threshold) for name, threshold in thresholds.items()},
        "curve": [told(threshold) for threshold in CURVE],
    }


def smoothed(scores: Scored, count: int) -> Scored:
    """Return the best word's mean score over as many moments; those before the first count as 0."""
    padded = np.pad(scores, ((0, 0), (count - 1, 0)))
    mean: Scored = np.lib.stride_tricks.sliding_window_view(padded, count, axis=1).mean(axis=2)
    best: Scored = mean.max(axis=0)
    return best


def _peaks(heard: Heard, smoothing: int) -> ByKind[list[float]]:
    """Return the highest score of each second of talk, by its kind and group."""
    size = round(REFRACTORY_S * RATE_HZ / HOP / STRIDE)
    peaks: ByKind[list[float]] = {kind: defaultdict(list) for kind in (ORDINARY, ALIKE)}
    for one in heard.talk:
        best = smoothed(one.scores, smoothing)
        highest = [float(best[at : at + size].max()) for at in range(0, len(best), size)]
        for group in _groups(one.engine):
            peaks[one.kind][group] += highest
    return peaks


def _threshold(peaks: list[float], most: float) -> float:
    """Return the lowest threshold of the grid with at most so many false alarms."""
    for threshold in GRID:
        if sum(peak >= threshold for peak in peaks) <= most:
            return threshold
    return GRID[-1]


def _told(
    heard: Heard, peaks: ByKind[list[float]], threshold: float, smoothing: int
) -> dict[str, Any]:
    missed: dict[str, dict[str, list[bool]]] = defaultdict(lambda: defaultdict(list))
    delays_s = []
    for trial in heard.trials:
        reached = np.flatnonzero(smoothed(trial.scores, smoothing) >= threshold)
        for group in (*_groups(trial.engine), f"word_{trial.word}"):
            missed[trial.snr][group].append(not len(reached))
        if len(reached):
            delays_s.append(float(trial.times_s[reached[0]]))
    ratios = {
        snr: {group: float(np.mean(flags)) for group, flags in groups.items()}
        for snr, groups in missed.items()
    }
    alarms = {
        kind: {
            group: sum(peak >= threshold for peak in highest) / heard.hours[kind][group]
            for group, highest in groups.items()
        }
        for kind, groups in peaks.items()
    }
    return {
        "threshold": threshold,
        "false_alarms_per_hour": alarms,
        "missed_mean": float(np.mean([ratios[snr][ALL] for snr in ("clean", "20", "10")])),
        "missed_ratio": ratios,
        "delay_p50_s": float(np.percentile(delays_s, 50)) if delays_s else LATE_S,
        "delay_p95_s": float(np.percentile(delays_s, 95)) if delays_s else LATE_S,
    }
