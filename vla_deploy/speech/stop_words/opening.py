"""Open the spotter that a profile chooses, and build the listeners around it."""

from collections.abc import Mapping
from typing import Final

from platforms import Profile
from vla_deploy.inference.roles import ModelShelf
from vla_deploy.node import NodeContext
from vla_deploy.speech.companions import Voice
from vla_deploy.speech.stop_words.listener import PAGE, StopWords
from vla_deploy.speech.stop_words.spotter import Spotter

ROLE: Final = "key_words"


def build_stop_words(
    context: NodeContext, profile: Profile, voice: Voice | None = None
) -> StopWords:
    """Return the listener; it opens the profile's model when the node starts."""
    # It claims no memory: what hears a spoken stop is never refused for want of it.
    shelf = ModelShelf.of_base(context.run_dir.parent, context.clock)
    return StopWords(
        lambda: open_spotter(shelf, profile),
        profile.speech,
        context.clock,
        lambda: None if voice is None else voice.playing,
    )


def build_page_stop_words(context: NodeContext, profile: Profile) -> StopWords:
    """Return the listener to the page, where the robot does not sound: it falls silent for it."""
    shelf = ModelShelf.of_base(context.run_dir.parent, context.clock)
    return StopWords(lambda: open_spotter(shelf, profile), profile.speech, context.clock, ear=PAGE)


def open_spotter(shelf: ModelShelf, profile: Profile) -> tuple[Spotter, Mapping[str, float]]:
    """Return the spotter and its thresholds, by how easily a word is taken for said.

    Raises:
        InferenceError: the profile's model cannot be opened.
        SpotterMismatch: it is not one that a spotter can run.
    """
    session = shelf.open(ROLE, profile, 0)
    manifest = session.model.manifest
    spotter = Spotter(session, manifest)
    assert manifest.key_words is not None, "the spotter has looked at it"
    return spotter, manifest.key_words.thresholds
