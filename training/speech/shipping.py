"""Judge a converted model, describe it, ship it if it is better than the one that is there."""

import json
import logging
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

from drivers.clock import MonotonicClock
from platforms import load_profile
from training.speech import calibration, judging
from training.speech.card import METRICS, TRAINING, card, read_metrics
from training.speech.sizes import TrainingSize
from training.speech.trials import sentences
from training.voices.clip_store import shards
from vla_deploy.inference.manifest import EncoderContext, Manifest, Whisper
from vla_deploy.inference.manifest_file import write_manifest
from vla_deploy.inference.store import StoredModel
from vla_deploy.model_tools.whispers import PLAIN_CHOICE, WhisperSource, describe
from vla_deploy.speech.recogniser import Recogniser, open_recogniser

SHIPPED: Final = Path(__file__).parents[2] / "vla_deploy" / "models" / "commands-whisper"
CARD, MODEL = "card.md", "model"
_SPEECH: Final = load_profile("desktop").speech
BEAM: Final = _SPEECH.beam
LEAST_CONFIDENCE: Final = _SPEECH.least_confidence
_SUMMARY: Final = "Spoken commands in the English of synthetic voices; never heard a person"
_CALIBRATION_CLIPS: Final = 300
_OTHER_SOUNDS: Final = 66
_CHOSEN_BY: Final = tuple(
    f"wer_{name}{noise}"
    for name in ("held_out_voices", "unseen_engine", "held_styles")
    for noise in ("", "_10db")
)
"""Word error rates over voices that were never heard, quiet and in noise."""
_LOG = logging.getLogger(__name__)


def judge(out: Path, size: TrainingSize) -> None:
    """Calibrate and judge the model under `out`; write manifest, figures and card beside it.

    Raises:
        InferenceError: it cannot be opened.
        EngineMissing: eSpeak NG or flite is not installed.
    """
    folder = out / MODEL
    plain = Whisper(languages=("en",), context=EncoderContext.TRIMMED)
    draft = _open(_manifest(folder, plain), folder)
    fitted = calibration.fit(calibration.readings(draft, _CALIBRATION_CLIPS, size.seed))
    draft.close()
    manifest = _manifest(folder, replace(plain, calibration=fitted))
    recogniser = _open(manifest, folder)
    metrics = _measure(recogniser, out, size)
    recogniser.close()
    (folder / METRICS).write_text(json.dumps(metrics, indent=1), encoding="utf-8")
    (folder / CARD).write_text(card(metrics, folder, size), encoding="utf-8")
    write_manifest(folder, manifest)


def _measure(recogniser: Recogniser, out: Path, size: TrainingSize) -> dict[str, Any]:
    seed = size.seed + 1
    figures, reads = judging.word_errors(recogniser, 1000, seed)
    others = judging.other_sounds(recogniser, LEAST_CONFIDENCE, _OTHER_SOUNDS, seed)
    training = json.loads((out / TRAINING).read_text(encoding="utf-8"))
    return {
        **figures,
        "sureness": judging.sureness(recogniser, reads, LEAST_CONFIDENCE),
        "least_confidence": LEAST_CONFIDENCE,
        "beam": BEAM,
        "other_sounds": {**others, "count": len(sentences("talk")[:_OTHER_SOUNDS])},
        "training": {**training, "clips": size.clips_per_shard * len(list(shards(out / "clips")))},
    }


def _open(manifest: Manifest, folder: Path) -> Recogniser:
    model = StoredModel(manifest=manifest, folder=folder, is_embedded=False)
    return open_recogniser(model, PLAIN_CHOICE, beam=BEAM, clock=MonotonicClock())


def _manifest(folder: Path, whisper: Whisper) -> Manifest:
    source = WhisperSource(
        name="commands-whisper",
        folder=folder,
        whisper=whisper,
        summary=_SUMMARY,
        licence="Apache-2.0",
        card=folder / CARD,
    )
    return describe(source)


def ship(out: Path, place: Path = SHIPPED) -> bool:
    """Copy the judged model; return whether it was done.

    Raises:
        FileNotFoundError: it is not complete.
    """
    folder = out / MODEL
    trained = read_metrics(folder / METRICS)
    if (place / METRICS).exists():
        shipped = read_metrics(place / METRICS)
        names = [one for one in _CHOSEN_BY if None not in (trained.get(one), shipped.get(one))]
        new, old = (_mean(metrics, names) for metrics in (trained, shipped))
        if new >= old:
            _LOG.warning("not shipped: word errors %.4f, those of %s are %.4f", new, place, old)
            return False
    shutil.rmtree(place, ignore_errors=True)
    shutil.copytree(folder, place)
    _LOG.info("shipped to %s", place)
    return True


def _mean(metrics: dict[str, Any], names: list[str]) -> float:
    """Return the mean word error rate over the sets of which both recognisers have one."""
    return sum(float(metrics[name]) for name in names) / len(names)
