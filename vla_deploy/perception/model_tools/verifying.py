"""Check an installed model: its files, its graphs, a trial run, and what a profile makes of it."""

import dataclasses
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial

from platforms import Profile
from vla_deploy.inference.errors import InferenceError
from vla_deploy.inference.file_check import checked_file
from vla_deploy.inference.manifest import Variant
from vla_deploy.inference.opening import PLAIN_CHOICE
from vla_deploy.inference.roles import ModelShelf, choice_for
from vla_deploy.inference.session import ModelSession, open_session
from vla_deploy.inference.store import Model
from vla_deploy.perception.detectors.detector import Detector
from vla_deploy.perception.model_tools.trial import try_out


@dataclass(frozen=True, slots=True, kw_only=True)
class Finding:
    """Hold one check and how it came out."""

    model: str
    check: str
    is_ok: bool
    detail: str


def verify(shelf: ModelShelf, name: str, profile: Profile | None = None) -> Iterator[Finding]:
    """Check a model by itself and, where a profile is given, as that profile would run it."""
    try:
        model = shelf.store.load(name)
    except InferenceError as error:
        yield Finding(model=name, check="manifest", is_ok=False, detail=str(error))
        return
    yield Finding(model=name, check="manifest", is_ok=True, detail=str(model.folder))
    for variant in model.manifest.files:
        yield _finding(name, f"file {variant}", partial(_whole, model, variant))
        yield _finding(name, f"run {variant}", partial(_trial, shelf, model, variant))
    if profile is not None:
        yield _finding(name, f"profile {profile.name}", partial(_as_profile, shelf, model, profile))


def _finding(model: str, check: str, act: Callable[[], str]) -> Finding:
    try:
        return Finding(model=model, check=check, is_ok=True, detail=act())
    except InferenceError as error:
        return Finding(model=model, check=check, is_ok=False, detail=str(error))


def _whole(model: Model, variant: Variant) -> str:
    return f"{checked_file(model, variant).name}, SHA-256 as in the manifest"


def _trial(shelf: ModelShelf, model: Model, variant: Variant) -> str:
    """Run one file on the CPU, whatever it is made for."""
    session = open_session(
        only(model, variant), PLAIN_CHOICE, engines=shelf.engines, clock=shelf.clock
    )
    return _tried(session)


def _as_profile(shelf: ModelShelf, model: Model, profile: Profile) -> str:
    choice = choice_for(model.manifest.role, profile)
    session = open_session(model, choice, engines=shelf.engines, clock=shelf.clock)
    told = "; ".join((f"{session.variant} on {session.provider}", *session.notices))
    return f"{told}; {_tried(session)}"


def _tried(session: ModelSession) -> str:
    try:
        if session.model.manifest.detection is None:
            return f"warm in {session.load_s:.2g} s"
        return str(try_out(Detector(session)))
    finally:
        session.close()


def only(model: Model, variant: Variant) -> Model:
    """Return a model that has no file but one, so that every precision gives that."""
    files = {variant: model.manifest.files[variant]}
    manifest = dataclasses.replace(model.manifest, files=files)
    return dataclasses.replace(model, manifest=manifest)
