"""Write the model's card and manifest from what was measured."""

import json
import time
from collections import Counter
from collections.abc import Mapping
from pathlib import Path
from string import Template
from typing import Any, Final

import numpy as np

from training.stop_words.cast import SHARES
from training.stop_words.corpus import TRAIN, Clips
from training.stop_words.evaluation import (
    ALARMS_PER_HOUR,
    ALIKE,
    ALL,
    ALL_BUT_KOKORO,
    METRICS,
    ORDINARY,
    REFRACTORY_S,
    SNRS_DB,
)
from training.stop_words.export import FILE, FRAMES, INPUT, MOMENTS, OUTPUT
from training.stop_words.network import REACH, StopNet
from training.stop_words.settings import StopWordSettings
from training.stop_words.texts import WORDS
from training.voices import kokoro
from vla_deploy.inference.manifest import (
    KeyWords,
    Manifest,
    ModelFile,
    SpottingMeasured,
    Tensor,
    Variant,
)
from vla_deploy.inference.manifest_file import write_manifest
from vla_deploy.inference.runtime import InferenceSession, SessionOptions
from vla_deploy.inference.store import sha256_of
from vla_deploy.speech.sound import RATE_HZ
from vla_deploy.speech.stop_words.features import BANDS, HOP, NAME

CARD: Final = "card.md"
TEMPLATE: Final = Path(__file__).with_name("card_template.md")
AIM_MISSED: Final = {"clean": 0.05, "10": 0.1}
AIM_ALARMS, AIM_DELAY_S = 1.0, 0.5
USUAL: Final = "low"
"""The threshold of the base profile."""
VOICES: Final = ("other engines", "held styles", "judged styles")
COSTS: Final = ("missed clean", "missed at 10 dB", "alarms per hour")
_RUNS: Final = 200


def describe(out: Path, models: Path, settings: StopWordSettings) -> None:
    """Write `card.md` and `model.toml` beside the file that they describe.

    Raises:
        FileNotFoundError: the model, its metrics or the clips that it learnt are not there.
    """
    metrics = json.loads((models / METRICS).read_text(encoding="utf-8"))
    clips = {kind: Counter(_engines(out, kind)) for kind in ("stops", "others")}
    (models / CARD).write_text(card(metrics, clips, models, settings), encoding="utf-8")
    place = models / "stop_words"
    place.mkdir(exist_ok=True)
    write_manifest(place, manifest(metrics, models))
    (place / "model.toml").rename(models / "model.toml")
    place.rmdir()


def _engines(out: Path, kind: str) -> list[str]:
    """Return the engine of each clip that was learnt from."""
    return [voice.partition("/")[0] for voice in Clips(out / "clips", TRAIN, kind).voices]


def card(
    metrics: dict[str, Any],
    clips: Mapping[str, Mapping[str, int]],
    models: Path,
    settings: StopWordSettings,
) -> str:
    """Return the model card; `clips` counts those of each engine, with a stop word and without."""
    stops, others = clips["stops"], clips["others"]
    counts = ", ".join(f"{engine} ({stops[engine]} and {others[engine]})" for engine in stops)
    share = SHARES[kokoro.ENGINE] / sum(SHARES[engine] for engine in stops)
    values = {
        "reach_s": f"{REACH * HOP / RATE_HZ:.2f}",
        "verdict": verdict(metrics),
        "bands": BANDS,
        "frames": FRAMES,
        "moments": MOMENTS,
        "words": ", ".join(WORDS),
        "parameters": sum(p.numel() for p in StopNet(len(WORDS)).parameters()),
        "size_kib": (models / FILE).stat().st_size // 1024,
        "run_ms": f"{_run_ms(models / FILE):.1f}",
        "engines": f"{counts}: clips with a stop word, and without",
        "kokoro_share": f"{share:.0%}",
        "styles": len(kokoro.STYLES + kokoro.OTHER_LANGUAGES),
        "alarms": ", ".join(f"{most:g}" for most in ALARMS_PER_HOUR.values()),
        "cpu_minutes": f"{settings.cpu_minutes:g}",
        "seed": settings.seed,
        "judged": ", ".join(kokoro.JUDGED),
        "tables": tables(metrics),
    }
    return Template(TEMPLATE.read_text(encoding="utf-8")).substitute(values)


def verdict(metrics: dict[str, Any]) -> str:
    """Return a sentence on whether it does what is asked of it."""
    told = metrics["judged"]["at"][USUAL]
    missed = {snr: told["missed_ratio"][snr][ALL] for snr in AIM_MISSED}
    alarms = told["false_alarms_per_hour"][ORDINARY][ALL]
    figures = (
        f"{missed['clean']:.1%} of the stops missed in quiet, {missed['10']:.1%} in noise at "
        f"10 dB, {alarms:.1f} false alarms per hour of ordinary talk, told within "
        f"{told['delay_p95_s']:.2f} s of the word's end (95 of 100)"
    )
    is_reached = (
        all(missed[snr] <= most for snr, most in AIM_MISSED.items())
        and alarms <= AIM_ALARMS
        and told["delay_p95_s"] <= AIM_DELAY_S
    )
    if is_reached:
        return f"By itself it reaches its aim on voices that it has not learnt: {figures}."
    aim = f"{AIM_MISSED['clean']:.0%}, {AIM_MISSED['10']:.0%}, {AIM_ALARMS:g}, {AIM_DELAY_S:g} s"
    return (
        f"**By itself it does not reach its aim ({aim}) on voices that it has not learnt: "
        f"{figures}.**"
    )


def tables(metrics: dict[str, Any]) -> str:
    """Return misses by noise and voice, then what each threshold costs whom."""
    missed = metrics["at"][USUAL]["missed_ratio"]
    missed_judged = metrics["judged"]["at"][USUAL]["missed_ratio"]
    groups = sorted(missed["clean"])
    words = ", ".join(f"word_{number + 1} is {word!r}" for number, word in enumerate(WORDS))
    rows = [
        [
            snr if SNRS_DB[snr] is None else f"{snr} dB",
            *(f"{missed[snr][group]:.1%}" for group in groups),
            f"{missed_judged[snr][ALL]:.1%}",
        ]
        for snr in missed
    ]
    hours = [
        f"{one['hours'][ORDINARY][ALL]:.1f} h ({one['hours'][ALIKE][ALL]:.1f})"
        for one in (metrics, metrics["judged"])
    ]
    lines = [
        *_table([f"missed at the threshold `{USUAL}`", *groups, "judged styles"], rows),
        "",
        f"{words}; `kokoro` are its held styles.",
        "",
        *_table(
            ["threshold", "", *(f"{voices}: {cost}" for voices in VOICES for cost in COSTS)],
            [
                *([f"`{name}`", *_costs(metrics, "at", name)] for name in metrics["thresholds"]),
                *(["", *_costs(metrics, "curve", place)] for place in range(len(metrics["curve"]))),
            ],
        ),
        "",
        "Alarms are per hour of ordinary talk, in brackets of talk made to sound like a stop word:",
        f"{hours[0]} by held voices, {hours[1]} by judged ones, each in quiet, at 20 and 10 dB.",
    ]
    return "\n".join(lines)


def _table(head: list[str], rows: list[list[str]]) -> list[str]:
    return [f"| {' | '.join(cells)} |" for cells in (head, len(head) * ["---"], *rows)]


def _costs(metrics: dict[str, Any], kind: str, key: str | int) -> list[str]:
    """Return a threshold, and what it costs on other engines, held styles and judged ones."""
    held, judged = metrics[kind][key], metrics["judged"][kind][key]
    cells = [str(held["threshold"])]
    for told, group in ((held, ALL_BUT_KOKORO), (held, kokoro.ENGINE), (judged, ALL)):
        missed, alarms = told["missed_ratio"], told["false_alarms_per_hour"]
        cells += [f"{missed[snr][group]:.1%}" for snr in AIM_MISSED]
        cells.append(f"{alarms[ORDINARY][group]:.1f} ({alarms[ALIKE][group]:.1f})")
    return cells


def manifest(metrics: dict[str, Any], models: Path) -> Manifest:
    """Return what the software is told of the model."""
    told = metrics["judged"]["at"][USUAL]
    return Manifest(
        name="stop_words",
        role="key_words",
        summary="Hears stop, halt and freeze; trained on synthetic voices alone",
        licence="Apache-2.0",
        card=CARD,
        inputs=(Tensor(name=INPUT, shape=(1, BANDS, FRAMES), dtype="float32"),),
        outputs=(Tensor(name=OUTPUT, shape=(1, 1 + len(WORDS), MOMENTS), dtype="float32"),),
        files={Variant.FP32: ModelFile(path=FILE, sha256=sha256_of(models / FILE))},
        key_words=KeyWords(
            features=NAME,
            words=WORDS,
            smoothing_frames=metrics["smoothing"],
            refractory_s=REFRACTORY_S,
            thresholds=metrics["thresholds"],
            measured=SpottingMeasured(
                missed_ratio=round(told["missed_ratio"]["10"][ALL], 4),
                false_alarms_per_hour=round(told["false_alarms_per_hour"][ORDINARY][ALL], 2),
                delay_p95_s=round(told["delay_p95_s"], 3),
            ),
        ),
    )


def _run_ms(path: Path) -> float:
    """Return how long one run takes on one thread, the median."""
    options = SessionOptions()
    options.intra_op_num_threads = 1
    session = InferenceSession(str(path), options)
    inputs = {INPUT: np.zeros((1, BANDS, FRAMES), np.float32)}
    took = []
    for _ in range(_RUNS):
        began = time.perf_counter()
        session.run(None, inputs)
        took.append(time.perf_counter() - began)
    return 1_000.0 * float(np.median(took))
