"""Add a person's language model: describe its folder, try it out, and only then keep it."""

from dataclasses import dataclass
from pathlib import Path
from typing import Final

from drivers.clock import Clock
from platforms import ModelChoice
from vla_deploy.inference.adding import CARD, keep_tried, require_free
from vla_deploy.inference.file_check import sha256_of
from vla_deploy.inference.language_schema import GENAI_CONFIG, PLANNER, TOKENIZER
from vla_deploy.inference.manifest import Language, Manifest, ModelFile, Use
from vla_deploy.inference.opening import PLAIN_CHOICE
from vla_deploy.inference.store import Model, ModelStore
from vla_deploy.model_servers.deadline import Deadline
from vla_deploy.planning.language_model.decoding import AnswerBounds
from vla_deploy.planning.language_model.errors import ModelFolderInvalid
from vla_deploy.planning.language_model.model import LanguageModel, ModelAnswer, open_language_model
from vla_deploy.planning.language_model.model_folder import (
    CONFIG,
    TEMPLATE,
    read_genai_config,
)

_PARTS: Final = (GENAI_CONFIG, TOKENIZER, CONFIG, TEMPLATE)
_WEIGHTS: Final = (".onnx", ".onnx.data", ".onnx_data")
TRIAL_S: Final = 120.0
TRIAL_SCHEMA: Final = {
    "type": "object",
    "properties": {"skill": {"enum": ["go_to", "wait"]}, "place": {"enum": ["kitchen", "hall"]}},
    "required": ["skill", "place"],
    "additionalProperties": False,
}
_TRIAL: Final = (
    {"role": "system", "content": "You plan for a robot. ModelAnswer with one step as JSON."},
    {"role": "user", "content": "go to the kitchen"},
)


@dataclass(frozen=True, slots=True, kw_only=True)
class LanguageModelSource:
    """Hold what a person says of a model."""

    name: str
    folder: Path
    most_tokens: int
    summary: str
    licence: str
    card: Path | None = None


def add_language_model(
    store: ModelStore,
    request: LanguageModelSource,
    *,
    clock: Clock,
    replace: bool = False,
    choice: ModelChoice = PLAIN_CHOICE,
) -> tuple[Model, ModelAnswer]:
    """Check a model, try it out as `choice` says, keep it; when anything is wrong, nothing changes.

    Returns the model, and its answer to a small command.

    Raises:
        ModelUnknown: the name cannot be used, or is taken and `replace` is not set.
        ModelFolderInvalid: files are missing, or do not fit together.
        InferenceError: it does not run; each kind says why.
        OSError: the model cannot be stored.
    """
    require_free(store, request.name, replace=replace)
    manifest = describe(request)
    files = {part.path: request.folder / part.path for part in manifest.parts}
    return keep_tried(
        store, manifest, files, request.card, lambda model: try_out(model, clock, choice)
    )


def describe(request: LanguageModelSource) -> Manifest:
    """Return the manifest for a folder of files.

    Raises:
        ModelFolderInvalid: one that is needed is missing, or the configuration has faults.
        ModelFileSpoiled: one cannot be read.
    """
    folder = request.folder
    graph = read_genai_config(folder).file_name
    names = sorted(path.name for path in folder.iterdir() if is_part(path.name))
    missing = [name for name in (GENAI_CONFIG, TOKENIZER, graph) if name not in names]
    if missing:
        raise ModelFolderInvalid(
            folder, tuple(f"{name} is missing; export the model again" for name in missing)
        )
    return Manifest(
        name=request.name,
        role=PLANNER,
        summary=request.summary,
        licence=request.licence,
        card=CARD if request.card else "",
        parts=tuple(ModelFile(path=name, sha256=sha256_of(folder / name)) for name in names),
        language=Language(use=Use.CHAT, most_tokens=request.most_tokens),
    )


def try_out(model: Model, clock: Clock, choice: ModelChoice = PLAIN_CHOICE) -> ModelAnswer:
    """Return a model's answer to a small command, as JSON of a small schema.

    Raises:
        InferenceError: it does not run, or not within two minutes; each kind says why.
    """
    opened = open_language_model(model, choice)
    try:
        return ask(opened, clock)
    finally:
        opened.close()


def ask(model: LanguageModel, clock: Clock) -> ModelAnswer:
    """Return an open model's answer to the same small command.

    Raises:
        InferenceError: there is no whole answer.
    """
    bounds = AnswerBounds(
        deadline=Deadline.within(clock, TRIAL_S), most_tokens=model.language.most_tokens
    )
    return model.answer(_TRIAL, bounds, dict(TRIAL_SCHEMA))


def is_part(name: str) -> bool:
    """Return whether a file of such a folder is used; the others are for other runtimes."""
    return name in _PARTS or name.endswith(_WEIGHTS)
