"""Open the spotter that a profile chooses."""

from collections.abc import Mapping

from platforms import Profile
from vla_deploy.inference.roles import ModelShelf
from vla_deploy.speech.stop_words.spotter import Spotter

ROLE = "key_words"


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
