"""Group the errors of language models by what the caller can do about them.

InferenceError
└── LanguageModelError
    ├── ModelFolderInvalid  the folder's files do not fit together: export it again
    └── AnswerFailed        there is no whole answer: ask another model
"""

from pathlib import Path

from vla_deploy.inference.errors import InferenceError


class LanguageModelError(InferenceError):
    """Base of everything that language models raise."""


class ModelFolderInvalid(LanguageModelError):
    """Report everything in a model's folder that does not fit together."""

    def __init__(self, folder: Path, *faults: str) -> None:
        super().__init__(f"{folder}: {'; '.join(faults)}")
        self.faults = faults


class AnswerFailed(LanguageModelError):
    """Say why there is no whole answer: time, tokens, context, or a schema that is none."""
