"""Run language models on board: one path for the embedded one and those that a person adds."""

from vla_deploy.inference.language_model.model import (
    AnswerBounds,
    LanguageModel,
    ModelAnswer,
    open_language_model,
)

__all__ = ["AnswerBounds", "LanguageModel", "ModelAnswer", "open_language_model"]
