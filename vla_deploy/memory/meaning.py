"""Find the text embedder by which the memory is searched by meaning, if one is installed."""

import logging
from typing import TYPE_CHECKING

from platforms import Profile
from vla_deploy.inference.errors import InferenceError
from vla_deploy.inference.manifest_schema import TEXT_EMBEDDER
from vla_deploy.inference.opening import PLAIN_CHOICE
from vla_deploy.inference.roles import ModelShelf
from vla_deploy.inference.store import ModelStore

if TYPE_CHECKING:
    from vla_deploy.inference.text_embedder import TextEmbedder

_log = logging.getLogger(__name__)


def installed_embedder(shelf: ModelShelf, profile: Profile | None = None) -> "TextEmbedder | None":
    """Open the text embedder that a profile names, else the first that was added; None without one.

    One that cannot be opened is done without: words find what is remembered, too.
    """
    choice = None if profile is None else profile.models.get(TEXT_EMBEDDER)
    name = choice.tiers[0] if choice is not None else first_added(shelf.store)
    if not name:
        return None
    wanted = choice or PLAIN_CHOICE
    try:
        model = shelf.store.load(name)
        # With it come libraries that a robot without such a model need not load.
        from vla_deploy.inference.text_embedder import open_text_embedder

        return shelf.load(model, wanted, lambda: open_text_embedder(model, wanted))
    except InferenceError as error:
        _log.warning("degraded: the memory is searched by words alone: %s", error)
        return None


def first_added(store: ModelStore) -> str:
    """Return the name of the first text embedder of the models folder, "" where there is none."""
    for name in store.names():
        try:
            if store.load(name).manifest.role == TEXT_EMBEDDER:
                return name
        except InferenceError:
            continue  # `vla-deploy models verify` reports the fault
    return ""
