"""Open the best recogniser that is there, of those that a profile names."""

from dataclasses import dataclass
from functools import partial

from platforms import Profile
from vla_deploy.inference.errors import InferenceError, ModelUnknown
from vla_deploy.inference.manifest_schema import SPEECH_TO_TEXT
from vla_deploy.inference.roles import ModelShelf, choice_for
from vla_deploy.runtime.one_line import one_line
from vla_deploy.speech.errors import SpeechError
from vla_deploy.speech.recogniser import Recogniser, open_recogniser


@dataclass(frozen=True, slots=True, kw_only=True)
class SelectedRecogniser:
    """Hold an open recogniser, or none; and why those before it, or all, could not be opened."""

    recogniser: Recogniser | None
    why: str = ""


def select_recogniser(shelf: ModelShelf, profile: Profile, model_tier: int) -> SelectedRecogniser:
    """Open the first model that can be, from `model_tier` on, or the last one before it.

    Where there is none, the robot goes on without.
    """
    try:
        choice = choice_for(SPEECH_TO_TEXT, profile)
    except InferenceError as error:
        return SelectedRecogniser(recogniser=None, why=one_line(error))
    first = min(model_tier, len(choice.tiers) - 1)
    reasons: list[str] = []
    for name in (*choice.tiers[first:], *reversed(choice.tiers[:first])):
        if name not in shelf.store.names():
            reasons.append(
                f"{name} is not here (vla-deploy models fetch {name}, or add {name} --whisper "
                "FOLDER)"
            )
            continue
        try:
            model = shelf.store.load(name)
            if model.manifest.whisper is None:
                raise ModelUnknown(f"{name} is a {model.manifest.role}, no Whisper")
            opening = partial(
                open_recogniser, model, choice, beam=profile.speech.beam, clock=shelf.clock
            )
            recogniser = shelf.load(model, choice, opening)
        except (InferenceError, SpeechError) as error:
            reasons.append(f"{name}: {one_line(error)}")
            continue
        return SelectedRecogniser(recogniser=recogniser, why="; ".join(reasons))
    return SelectedRecogniser(recogniser=None, why="; ".join(reasons))
