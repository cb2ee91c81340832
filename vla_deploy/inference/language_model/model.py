"""Open a language model from its folder and answer prompts with it."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from threading import Lock
from typing import Final

import numpy as np

from platforms import ModelChoice
from vla_deploy.inference.errors import AnswerFailed, ModelMismatch
from vla_deploy.inference.language_model.decoding import Constraint, Decoder, JsonSchema, Scores
from vla_deploy.inference.language_model.model_folder import (
    ChatTemplate,
    Message,
    read_genai_config,
    read_tokenizers,
)
from vla_deploy.inference.manifest import Language
from vla_deploy.inference.opening import open_graph
from vla_deploy.inference.store import StoredModel
from vla_deploy.runtime.deadline import Deadline

# Tokens of one run. Exports score every token that they read: 3000 of a prompt at once would be
# gigabytes of scores, of which the last is wanted, and seconds that nothing can break off.
PIECE_TOKENS: Final = 128


@dataclass(frozen=True, slots=True, kw_only=True)
class AnswerBounds:
    """Bound an answer: it ends by the deadline, which also a recall ends, and by its length."""

    deadline: Deadline
    most_tokens: int

    def check(self, count: int) -> None:
        """Accept an answer that has so many tokens and is not whole yet.

        Raises:
            AnswerFailed: the deadline passed, it was recalled, or it may not be longer.
        """
        if self.deadline.is_recalled:
            why = "nobody waits for it any more"
        elif self.deadline.left_s <= 0.0:
            why = "time is up"
        elif count >= self.most_tokens:
            why = "it may have no more"
        else:
            return
        raise AnswerFailed(f"the answer is not whole after {count} tokens: {why}")


@dataclass(frozen=True, slots=True, kw_only=True)
class ModelAnswer:
    """Hold a whole answer, and what it cost.

    `chosen` is the log-probability of each token that the model was asked for, among all tokens,
    also those that the schema forbids: it is low where the model would have said something else.
    """

    text: str
    chosen: tuple[float, ...]
    prompt_tokens: int
    reused_tokens: int
    runs: int


class LanguageModel:
    """Answer prompts, one at a time; a prompt that begins as the last one did is read faster."""

    def __init__(self, folder: Path, language: Language, choice: ModelChoice) -> None:
        """Open the files of a folder.

        Raises:
            ModelMismatch: they do not fit together.
            ModelFileSpoiled: the graph cannot be loaded.
            ProviderUnavailable: no provider that the choice allows runs it.
        """
        self.language = language
        self.config = read_genai_config(folder)
        self.tokenizer, self.guide = read_tokenizers(folder, self.config)
        self.template = ChatTemplate(folder)
        self._session = open_graph(folder / self.config.file_name, choice)
        self.decoder = Decoder(self._session, self.config)
        self.notices = self._session.notices
        self.provider = self._session.provider
        self._one_at_a_time = Lock()

    def answer(
        self, messages: Sequence[Message], bounds: AnswerBounds, schema: JsonSchema
    ) -> ModelAnswer:
        """Return the likeliest answer that is JSON of the schema.

        Raises:
            AnswerFailed: there is no whole answer; says why.
            RunFailed: a run failed.
        """
        text = self.template.prompt(messages)
        prompt = self.tokenizer.encode(text, add_special_tokens=False).ids
        with self._one_at_a_time:
            return self.generate(prompt, Constraint(self.guide, schema), bounds)

    def generate(
        self, prompt: Sequence[int], constraint: Constraint, bounds: AnswerBounds
    ) -> ModelAnswer:
        """Answer a prompt by the likeliest token each time, of those that are allowed.

        Forced tokens go in with the next token that the model is asked for, in one run. A long
        prompt is read piece by piece.

        Raises:
            AnswerFailed: there is no whole answer within the bounds.
            RunFailed: a run failed.
        """
        reused = self.decoder.keep(prompt)
        waiting = list(prompt[reused:])
        tokens: list[int] = []
        chosen: list[float] = []
        runs = 0
        while True:
            if forced := constraint.forced():
                constraint.take(forced)
                tokens += forced
                waiting += forced
            if constraint.is_done:
                break
            self.decoder.check_room(len(waiting))
            for begin in range(0, len(waiting), PIECE_TOKENS):
                bounds.check(len(tokens))
                scores = self.decoder.feed(waiting[begin : begin + PIECE_TOKENS])
                runs += 1
            token, log_probability = _likeliest(scores, constraint)
            if token in self.config.end_ids:
                break
            tokens.append(token)
            chosen.append(log_probability)
            waiting = [token]
            constraint.take(waiting)
        return ModelAnswer(
            text=self.tokenizer.decode(tokens),
            chosen=tuple(chosen),
            prompt_tokens=len(prompt),
            reused_tokens=reused,
            runs=runs,
        )

    def close(self) -> None:
        """Release the memory; an answer after that fails."""
        self._session.close()


def open_language_model(model: StoredModel, choice: ModelChoice) -> LanguageModel:
    """Open a model of the store, every file of it as it was checked in.

    Raises:
        ModelMismatch: it is no language model, or its files do not fit together.
        ModelFileSpoiled: a file is missing or not what was checked in.
        ProviderUnavailable: no provider that the choice allows runs it.
    """
    language = model.manifest.language
    if language is None:
        raise ModelMismatch(model.manifest.name, ("expected a [language] table, there is none",))
    model.check_parts()
    return LanguageModel(model.folder, language, choice)


def _likeliest(scores: Scores, constraint: Constraint) -> tuple[int, float]:
    """Return the likeliest token of those allowed, and its log-probability among all."""
    allowed = np.where(constraint.allowed(len(scores)), scores, -np.inf)
    number = int(np.argmax(allowed))
    highest = float(scores.max())
    total = highest + float(np.log(np.exp(scores - highest).sum()))
    return number, float(scores[number]) - total
