"""Add a person's Whisper in CTranslate2's form: describe it, try it out, and only then keep it."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

import numpy as np

from drivers.clock import Clock
from platforms import ModelChoice
from vla_deploy.inference import opening
from vla_deploy.inference.adding import CARD, keep_tried, require_free
from vla_deploy.inference.errors import ModelFileSpoiled
from vla_deploy.inference.file_check import sha256_of
from vla_deploy.inference.manifest import Manifest, ModelFile, Whisper
from vla_deploy.inference.store import Model, ModelStore
from vla_deploy.inference.whisper_schema import NEEDED_PARTS, SPEECH_TO_TEXT, VOCABULARIES
from vla_deploy.speech.recogniser import open_recogniser
from vla_deploy.speech.sound import RATE_HZ
from vla_deploy.speech.transcript import Transcript

PARTS: Final = (*NEEDED_PARTS, *VOCABULARIES, "preprocessor_config.json")
PLAIN_CHOICE: Final = replace(opening.PLAIN_CHOICE, precision="int8")
"""To look at a model by itself, as no profile is needed for."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Request:
    """Hold what a person tells of a model."""

    name: str
    folder: Path
    whisper: Whisper
    summary: str
    licence: str
    card: Path | None = None


def add_whisper(
    store: ModelStore, request: Request, *, clock: Clock, replace: bool = False
) -> tuple[Model, Transcript]:
    """Check a model, try it out and keep it; when anything is wrong, nothing has changed.

    Returns the model, and what it reads in a second of silence.

    Raises:
        ModelUnknown: the name cannot be used, or is taken and `replace` is not set.
        ModelFileSpoiled: a file is missing, or they are no Whisper.
        RunFailed: it cannot run.
        SpeechMissing: faster-whisper is not installed.
        OSError: the model cannot be stored.
    """
    require_free(store, request.name, replace=replace)
    manifest = describe(request)
    files = {part.path: request.folder / part.path for part in manifest.parts}
    return keep_tried(store, manifest, files, request.card, lambda model: try_out(model, clock))


def describe(request: Request) -> Manifest:
    """Return the manifest for a folder of files.

    Raises:
        ModelFileSpoiled: one of those that are needed is missing, or cannot be read.
    """
    folder = request.folder
    there = [name for name in PARTS if (folder / name).is_file()]
    missing = [name for name in NEEDED_PARTS if name not in there]
    missing += [] if any(name in there for name in VOCABULARIES) else [VOCABULARIES[0]]
    if missing:
        raise ModelFileSpoiled(
            f"{folder}: {', '.join(missing)} missing; expected a Whisper as CTranslate2 converts "
            "it: ct2-transformers-converter --model MODEL --output_dir DIR --quantization int8 "
            "--copy_files tokenizer.json preprocessor_config.json"
        )
    return Manifest(
        name=request.name,
        role=SPEECH_TO_TEXT,
        summary=request.summary,
        licence=request.licence,
        card=CARD if request.card else "",
        parts=tuple(ModelFile(path=name, sha256=sha256_of(folder / name)) for name in there),
        whisper=request.whisper,
    )


def try_out(model: Model, clock: Clock, choice: ModelChoice = PLAIN_CHOICE) -> Transcript:
    """Return what a model reads in a second of silence.

    Raises:
        InferenceError: it does not run; each kind says why.
        SpeechMissing: faster-whisper is not installed.
    """
    recogniser = open_recogniser(model, choice, beam=1, clock=clock)
    try:
        return recogniser.read(np.zeros(RATE_HZ, np.float32))
    finally:
        recogniser.close()
