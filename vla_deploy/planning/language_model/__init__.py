"""Run language models on board: one path for the embedded one and those that a person adds."""

from vla_deploy.planning.language_model.decoding import Bounds, Token
from vla_deploy.planning.language_model.errors import (
    AnswerCut,
    AnswerLate,
    LanguageModelError,
    ModelFolderInvalid,
    PromptTooLong,
    SchemaUnusable,
)
from vla_deploy.planning.language_model.model import Answer, LanguageModel, open_language_model
from vla_deploy.planning.language_model.model_folder import Message

__all__ = [
    "Answer",
    "AnswerCut",
    "AnswerLate",
    "Bounds",
    "LanguageModel",
    "LanguageModelError",
    "Message",
    "ModelFolderInvalid",
    "PromptTooLong",
    "SchemaUnusable",
    "Token",
    "open_language_model",
]
