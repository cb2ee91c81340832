"""Group the errors of hearing by what the caller can do about them.

SpeechError
├── SpeechMissing       the `speech` extra is not installed: install it
├── RecordingsInvalid   recordings to learn from cannot be used: mend the folder
├── NoRecogniser        no model can be opened: the robot is deaf to words, typed commands go on
└── SpotterMismatch     the model is not one that the spotter of stop words can run: choose another
"""


class SpeechError(Exception):
    """Base of everything that hearing raises."""


class SpeechMissing(SpeechError):
    """Say that a package is missing, and how to install it."""


class RecordingsInvalid(SpeechError):
    """Say what is wrong with a folder of recordings."""


class NoRecogniser(SpeechError):
    """Say why no model turns speech into text."""


class SpotterMismatch(SpeechError):
    """Say what a model needs that the spotter does not give."""
