"""Group what the world model refuses by what the caller can do.

WorldError
├── SceneUnreadable   the document is no scene: look at who writes it
└── UnknownWord       say it in words that the vocabulary has
"""

from collections.abc import Iterable


class WorldError(Exception):
    """Base of everything that the world model refuses."""


class SceneUnreadable(WorldError):
    """Say what a scene document lacks."""


class UnknownWord(WorldError):
    """Say which word of a query means nothing here, and which would."""

    def __init__(self, text: str, word: str, known: Iterable[str]) -> None:
        self.word = word
        super().__init__(f'"{text}": I do not know "{word}"; I know: {", ".join(known)}')
