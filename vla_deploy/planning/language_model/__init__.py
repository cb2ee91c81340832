"""Run language models on board: one path for the embedded one and those that a person adds."""

from vla_deploy.planning.language_model.decoding import AnswerBounds
from vla_deploy.planning.language_model.errors import (
    AnswerCut,
    AnswerLate,
    LanguageModelError,
    ModelFolderInvalid,
    PromptTooLong,
    SchemaUnusable,
)
from vla_deploy.planning.language_model.model import LanguageModel, ModelAnswer, open_language_model
from vla_deploy.planning.language_model.model_folder import Message

__all__ = [
    "AnswerBounds",
    "AnswerCut",
    "AnswerLate",
    "LanguageModel",
    "LanguageModelError",
    "Message",
    "ModelAnswer",
    "ModelFolderInvalid",
    "PromptTooLong",
    "SchemaUnusable",
    "open_language_model",
]
