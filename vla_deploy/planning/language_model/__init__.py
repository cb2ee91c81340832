"""Run language models on board: one path for the embedded one and those that a person adds."""

from vla_deploy.planning.language_model.errors import (
    AnswerFailed,
    LanguageModelError,
    ModelFolderInvalid,
)
from vla_deploy.planning.language_model.model import (
    AnswerBounds,
    LanguageModel,
    ModelAnswer,
    open_language_model,
)

__all__ = [
    "AnswerBounds",
    "AnswerFailed",
    "LanguageModel",
    "LanguageModelError",
    "ModelAnswer",
    "ModelFolderInvalid",
    "open_language_model",
]
