"""Open the best recogniser that is there, of those that a profile names."""

import logging
from dataclasses import dataclass
from functools import partial

from platforms import Profile
from vla_deploy.inference.errors import InferenceError, ModelUnknown
from vla_deploy.inference.roles import ModelShelf, choice_for
from vla_deploy.inference.whisper_schema import SPEECH_TO_TEXT
from vla_deploy.one_line import one_line
from vla_deploy.speech.errors import NoRecogniser, SpeechError
from vla_deploy.speech.model_tools.fetching import PUBLISHED
from vla_deploy.speech.recogniser import Recogniser, open_recogniser

_log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True, kw_only=True)
class SelectedRecogniser:
    """Hold an open recogniser, or why there is none."""

    recogniser: Recogniser | None
    why: str = ""


def open_best(shelf: ModelShelf, profile: Profile, model_tier: int) -> Recogniser:
    """Open the first model that can be, from `model_tier` on, or the last one before it.

    What was left out, and why, is in its notices.

    Raises:
        NoRecogniser: none of them can be opened; every reason is told.
    """
    try:
        choice = choice_for(SPEECH_TO_TEXT, profile)
    except InferenceError as error:
        raise NoRecogniser(one_line(error)) from error
    first = min(model_tier, len(choice.tiers) - 1)
    reasons: list[str] = []
    for name in (*choice.tiers[first:], *reversed(choice.tiers[:first])):
        if name not in shelf.store.names():
            reasons.append(_absent(name))
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
        recogniser.notices = tuple(reasons)
        return recogniser
    raise NoRecogniser("; ".join(reasons))


def _absent(name: str) -> str:
    remedy = f"fetch {name}" if name in PUBLISHED else f"add {name} --whisper FOLDER"
    return f"{name} is not here (vla-deploy models {remedy})"


def select_recogniser(shelf: ModelShelf, profile: Profile, model_tier: int) -> SelectedRecogniser:
    """Open the best recogniser; where there is none, say why: the robot goes on without."""
    try:
        recogniser = open_best(shelf, profile, model_tier)
    except NoRecogniser as error:
        _log.error("degraded: no model turns speech into text, type commands: %s", error)
        return SelectedRecogniser(recogniser=None, why=str(error))
    for notice in recogniser.notices:
        _log.warning("degraded: %s", notice)
    return SelectedRecogniser(recogniser=recogniser)
