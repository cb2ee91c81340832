"""Group the errors of the stop words by what the caller can do about them.

StopWordsError
└── SpotterMismatch   the model is not one that this spotter can run: choose another one
"""


class StopWordsError(Exception):
    """Base of everything that the spotter raises."""


class SpotterMismatch(StopWordsError):
    """Say what a model needs that this spotter does not give."""
