"""Hold keys and passwords so that nothing prints them."""

from typing import Final

_HIDDEN: Final = "[key]"


class Secret:
    """Hold a key that no `str`, `repr`, format or comparison reveals."""

    __slots__ = ("_text",)

    def __init__(self, text: str) -> None:
        self._text = text

    def __repr__(self) -> str:
        return f"Secret({_HIDDEN})"

    def __reduce__(self) -> str:
        raise TypeError("a secret is not copied out of its process")

    def reveal(self) -> str:
        """Return the key, for the header that carries it and nothing else."""
        return self._text

    def hidden_in(self, text: str) -> str:
        """Return a text with every occurrence of the key replaced."""
        return text.replace(self._text, _HIDDEN)
