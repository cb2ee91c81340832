"""Group the errors of hearing by what the caller can do about them.

SpeechError
├── SpeechMissing         the `speech` extra is not installed: install it
└── RecordingsInvalid     recordings to learn from cannot be used: mend the folder
"""

from importlib import import_module
from typing import Any


class SpeechError(Exception):
    """Base of everything that hearing raises."""


class SpeechMissing(SpeechError):
    """Say that a package is missing, and how to install it."""


class RecordingsInvalid(SpeechError):
    """Say what is wrong with a folder of recordings."""


def import_extra(module: str, purpose: str) -> Any:
    """Return a module of the `speech` extra, or one of ours that needs it.

    Raises:
        SpeechMissing: it is not installed.
    """
    try:
        return import_module(module)
    except ImportError as error:
        raise SpeechMissing(
            f"{purpose} ({error}): pip install 'vla-deploy[speech]'; typed commands go on"
        ) from error
