"""Check an installed model: its files, a trial run, and what a profile makes of it."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial

from platforms import ModelChoice, Profile
from vla_deploy.inference.errors import InferenceError
from vla_deploy.inference.manifest import Variant
from vla_deploy.inference.opening import PLAIN_CHOICE
from vla_deploy.inference.roles import ModelShelf, choice_for
from vla_deploy.inference.session import ModelSession, open_session
from vla_deploy.inference.store import StoredModel
from vla_deploy.model_tools import language_models, text_embedders, whispers
from vla_deploy.model_tools.detectors.adding import try_out
from vla_deploy.speech.errors import SpeechError


@dataclass(frozen=True, slots=True, kw_only=True)
class ModelFinding:
    """Hold one check and how it came out."""

    model: str
    check: str
    is_ok: bool
    detail: str


def verify(shelf: ModelShelf, name: str, profile: Profile | None = None) -> Iterator[ModelFinding]:
    """Check a model by itself and, where a profile is given, as that profile would run it.

    A model of several files, which takes seconds to load, is run once.
    """
    try:
        model = shelf.store.load(name)
    except InferenceError as error:
        yield ModelFinding(model=name, check="manifest", is_ok=False, detail=str(error))
        return
    yield ModelFinding(model=name, check="manifest", is_ok=True, detail=str(model.folder))
    if model.manifest.parts:
        yield _finding(name, "files", partial(_all_parts, model))
    for variant in model.manifest.files:
        yield _finding(name, f"file {variant}", partial(_whole, model, variant))
        yield _finding(name, f"run {variant}", partial(_trial, shelf, model, variant))
    if profile is not None:
        yield _finding(name, f"profile {profile.name}", partial(_as_profile, shelf, model, profile))
    elif model.manifest.parts:
        yield _finding(name, "run", partial(_parts_tried, shelf, model, None))


def _finding(model: str, check: str, act: Callable[[], str]) -> ModelFinding:
    try:
        return ModelFinding(model=model, check=check, is_ok=True, detail=act())
    except (InferenceError, SpeechError) as error:
        return ModelFinding(model=model, check=check, is_ok=False, detail=str(error))


def _all_parts(model: StoredModel) -> str:
    model.check_parts()
    return f"{len(model.manifest.parts)} files, SHA-256 as in the manifest"


def _whole(model: StoredModel, variant: Variant) -> str:
    return f"{model.checked_file(variant).name}, SHA-256 as in the manifest"


def _trial(shelf: ModelShelf, model: StoredModel, variant: Variant) -> str:
    """Run one file on the CPU, whatever it is made for."""
    session = open_session(
        model.only(variant), PLAIN_CHOICE, engines=shelf.engines, clock=shelf.clock
    )
    return _tried(session)


def _as_profile(shelf: ModelShelf, model: StoredModel, profile: Profile) -> str:
    choice = choice_for(model.manifest.role, profile)
    if model.manifest.parts:
        return _parts_tried(shelf, model, choice)
    session = open_session(model, choice, engines=shelf.engines, clock=shelf.clock)
    opened = f"{session.variant} on {session.provider}"
    return "; ".join((opened, *session.notices, _tried(session)))


def _parts_tried(shelf: ModelShelf, model: StoredModel, choice: ModelChoice | None) -> str:
    """Run a model of several files, as plainly as it goes without a choice."""
    if model.manifest.embedding is not None:
        trial = text_embedders.try_out(model, choice or PLAIN_CHOICE)
        return f"one meaning {trial.same:.2f} alike, two meanings {trial.other:.2f}"
    if model.manifest.whisper is None:
        answer = language_models.try_out(model, shelf.clock, choice or PLAIN_CHOICE)
        return f"answers {answer.text} in {answer.runs} runs"
    choice = choice or whispers.PLAIN_CHOICE
    silence = whispers.try_out(model, shelf.clock, choice)
    took = f"{choice.precision}, {choice.threads} threads, {1000 * silence.took_s:.0f} ms"
    return f"reads {silence.text!r} in silence; {took}"


def _tried(session: ModelSession) -> str:
    if session.model.manifest.detection is not None:
        return str(try_out(session))
    session.close()
    return f"warm in {session.load_s:.2g} s"
