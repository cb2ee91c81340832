"""List what is checked of an installed Whisper, each check a function that tells what it found."""

from collections.abc import Callable, Iterator
from functools import partial

from platforms import Profile
from vla_deploy.inference.file_check import check_parts
from vla_deploy.inference.roles import ModelShelf, choice_for
from vla_deploy.inference.store import Model
from vla_deploy.speech.model_tools.adding import PLAIN_CHOICE, try_out

Check = Callable[[], str]


def checks_of(
    shelf: ModelShelf, model: Model, profile: Profile | None = None
) -> Iterator[tuple[str, Check]]:
    """Yield the name of each check and what does it; it raises InferenceError where it fails."""
    yield "files", partial(_files, model)
    yield "run int8", partial(_run, shelf, model)
    if profile is not None:
        yield f"profile {profile.name}", partial(_as_profile, shelf, model, profile)


def _files(model: Model) -> str:
    check_parts(model)
    return f"{len(model.manifest.parts)} files, SHA-256 as in the manifest"


def _run(shelf: ModelShelf, model: Model) -> str:
    reading = try_out(model, shelf.clock, PLAIN_CHOICE)
    return f"reads {reading.text!r} in silence, in {1000 * reading.took_s:.0f} ms"


def _as_profile(shelf: ModelShelf, model: Model, profile: Profile) -> str:
    choice = choice_for(model.manifest.role, profile)
    reading = try_out(model, shelf.clock, choice)
    return f"{choice.precision}, {choice.threads} threads, {1000 * reading.took_s:.0f} ms"
