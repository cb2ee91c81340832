"""Open a language model from its folder and answer prompts with it."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from threading import Lock
from typing import Final

from llguidance import LLTokenizer
from tokenizers import Tokenizer

from platforms import ModelChoice
from vla_deploy.inference.errors import ModelMismatch
from vla_deploy.inference.file_check import check_parts
from vla_deploy.inference.graph_session import GraphSession
from vla_deploy.inference.language_schema import TOKENIZER
from vla_deploy.inference.manifest import Language
from vla_deploy.inference.store import Model
from vla_deploy.planning.language_model.decoding import (
    AnswerBounds,
    Constraint,
    Decoder,
    Generated,
    JsonSchema,
    generate,
    grammar_of,
)
from vla_deploy.planning.language_model.errors import ModelFolderInvalid
from vla_deploy.planning.language_model.model_folder import (
    ChatTemplate,
    GenaiConfig,
    Message,
    read_genai_config,
)

# Exports pad their vocabulary up to a round number of rows.
_MOST_PADDING: Final = 1024


@dataclass(frozen=True, slots=True, kw_only=True)
class ModelAnswer(Generated):
    """Hold a whole answer, and how many runs of the model it took."""

    text: str
    prompt_tokens: int


class LanguageModel:
    """Answer prompts, one at a time; a prompt that begins as the last one did is read faster."""

    def __init__(self, folder: Path, language: Language, choice: ModelChoice) -> None:
        """Open the files of a folder.

        Raises:
            ModelFolderInvalid: they do not fit together.
            ModelFileSpoiled: the graph cannot be loaded.
            ProviderUnavailable: no provider that the choice allows runs it.
        """
        self.language = language
        self.config = read_genai_config(folder)
        self.tokenizer, self.guide = _tokenizers(folder, self.config)
        self._template = ChatTemplate(folder)
        self._session = GraphSession(folder / self.config.file_name, choice)
        self.decoder = Decoder(self._session, self.config)
        self.notices = self._session.notices
        self.provider = self._session.provider
        self._one_at_a_time = Lock()

    def answer(
        self, messages: Sequence[Message], bounds: AnswerBounds, schema: JsonSchema
    ) -> ModelAnswer:
        """Return the likeliest answer that is JSON of the schema.

        Raises:
            LanguageModelError: there is no whole answer; each kind says why.
            RunFailed: a run failed.
        """
        prompt = self.tokenizer.encode(self.prompt(messages), add_special_tokens=False).ids
        constraint = Constraint(self.guide, grammar_of(schema))
        with self._one_at_a_time:
            done = generate(self.decoder, prompt, constraint, self.config.end_ids, bounds)
        return ModelAnswer(
            text=self.tokenizer.decode(list(done.tokens)),
            tokens=done.tokens,
            chosen=done.chosen,
            prompt_tokens=len(prompt),
            reused_tokens=done.reused_tokens,
            runs=done.runs,
        )

    def prompt(self, messages: Sequence[Message]) -> str:
        """Return the text that the model is given for messages.

        Raises:
            ModelFolderInvalid: its chat template does not take them.
        """
        return self._template.prompt(messages)

    def close(self) -> None:
        """Release the memory; an answer after that fails."""
        self._session.close()


def open_language_model(model: Model, choice: ModelChoice) -> LanguageModel:
    """Open a model of the store, every file of it as it was checked in.

    Raises:
        ModelMismatch: it is no language model.
        ModelFileSpoiled: a file is missing or not what was checked in.
        ModelFolderInvalid: its files do not fit together.
        ProviderUnavailable: no provider that the choice allows runs it.
    """
    language = model.manifest.language
    if language is None:
        raise ModelMismatch(model.manifest.name, ("expected a [language] table, there is none",))
    check_parts(model)
    return LanguageModel(model.folder, language, choice)


def _tokenizers(folder: Path, config: GenaiConfig) -> tuple[Tokenizer, LLTokenizer]:
    file = folder / TOKENIZER
    try:
        text = file.read_text(encoding="utf-8")
        tokenizer = Tokenizer.from_str(text)
    # tokenizers raises plain Exception for every fault of a file.
    except Exception as error:
        raise ModelFolderInvalid(folder, (f"{TOKENIZER}: {error}",)) from error
    size = tokenizer.get_vocab_size()
    faults = tuple(_vocabulary_faults(size, config))
    if faults:
        raise ModelFolderInvalid(folder, faults)
    guide = LLTokenizer(text, n_vocab=max(config.vocabulary, size), eos_token=config.end_ids[0])
    return tokenizer, guide


def _vocabulary_faults(size: int, config: GenaiConfig) -> list[str]:
    """Compare the tokenizer with the decoder: another model's would give nonsense, unnoticed."""
    faults = []
    if size > config.vocabulary or config.vocabulary - size > _MOST_PADDING:
        faults.append(
            f"{TOKENIZER} has {size} tokens, expected {config.vocabulary} as genai_config.json "
            "says: it is another model's"
        )
    beyond = [one for one in config.end_ids if one >= size]
    if beyond:
        faults.append(f"model.eos_token_id: {beyond} are beyond the {size} tokens of {TOKENIZER}")
    return faults
