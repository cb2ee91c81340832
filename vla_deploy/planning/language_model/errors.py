"""Group the errors of language models by what the caller can do about them.

InferenceError
└── LanguageModelError
    ├── ModelFolderInvalid  the folder's files do not fit together: export it again
    ├── SchemaUnusable      no grammar can be made of the JSON Schema: simplify it
    ├── PromptTooLong       shorten it, or take a model with a longer context
    ├── AnswerCut           the answer came to its bound before it was whole: allow more tokens
    └── AnswerLate          the deadline passed, or it is not awaited any more: ask another
"""

from pathlib import Path

from vla_deploy.inference.errors import InferenceError


class LanguageModelError(InferenceError):
    """Base of everything that language models raise."""


class ModelFolderInvalid(LanguageModelError):
    """Report everything in a model's folder that does not fit together."""

    def __init__(self, folder: Path, faults: tuple[str, ...]) -> None:
        super().__init__(f"{folder}: {'; '.join(faults)}")
        self.faults = faults


class SchemaUnusable(LanguageModelError):
    """Say why no grammar can be made of a schema."""


class PromptTooLong(LanguageModelError):
    """Say how long a prompt is, and how long it may be."""


class AnswerCut(LanguageModelError):
    """Say that an answer was not whole when it came to its bound."""


class AnswerLate(LanguageModelError):
    """Say that an answer was not whole in time."""
