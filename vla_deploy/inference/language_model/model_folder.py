"""Read a model's folder in the layout of onnxruntime-genai: sizes, tokenizer, chat template.

Chat templates are programs of the model's author; they run in a sandbox that can change nothing.
"""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, Final

from jinja2 import Template, TemplateError
from jinja2.sandbox import ImmutableSandboxedEnvironment
from llguidance import LLTokenizer
from pydantic import AliasPath, BaseModel, BeforeValidator, ConfigDict, Field, ValidationError
from tokenizers import Tokenizer

from vla_deploy.inference.errors import ModelMismatch
from vla_deploy.inference.manifest_schema import GENAI_CONFIG, TOKENIZER

CONFIG: Final = "tokenizer_config.json"
# Newer exports keep it in a file of its own.
TEMPLATE: Final = "chat_template.jinja"
# Exports pad their vocabulary up to a round number of rows.
_MOST_PADDING: Final = 1024
Message = Mapping[str, str]

_Count = Annotated[int, Field(gt=0, strict=True)]
_TokenIds = Annotated[
    tuple[Annotated[int, Field(ge=0, strict=True)], ...],
    Field(min_length=1),
    BeforeValidator(lambda given: given if isinstance(given, list) else [given]),
]


class GenaiConfig(BaseModel):
    """Hold the sizes of a decoder; tokens in `end_ids` end an answer."""

    model_config = ConfigDict(frozen=True)

    vocabulary: _Count = Field(validation_alias=AliasPath("model", "vocab_size"))
    context_tokens: _Count = Field(validation_alias=AliasPath("model", "context_length"))
    end_ids: _TokenIds = Field(validation_alias=AliasPath("model", "eos_token_id"))
    file_name: str = Field(validation_alias=AliasPath("model", "decoder", "filename"))


def read_genai_config(folder: Path) -> GenaiConfig:
    """Read the file of a model's folder.

    Raises:
        ModelMismatch: it is missing, is no JSON, or lacks something; all faults are listed.
    """
    try:
        return GenaiConfig.model_validate(_json_object(folder, GENAI_CONFIG))
    except ValidationError as error:
        faults = (
            f"{GENAI_CONFIG}: {'.'.join(map(str, one['loc']))}: {one['msg']}"
            for one in error.errors(include_url=False)
        )
        raise ModelMismatch(str(folder), tuple(faults)) from error


def read_tokenizers(folder: Path, config: GenaiConfig) -> tuple[Tokenizer, LLTokenizer]:
    """Return the model's tokenizer, and the same for constraints.

    Raises:
        ModelMismatch: there is none, or it is another model's: it would give nonsense.
    """
    try:
        text = (folder / TOKENIZER).read_text(encoding="utf-8")
        tokenizer = Tokenizer.from_str(text)
    # tokenizers raises plain Exception for every fault of a file.
    except Exception as error:
        raise ModelMismatch(str(folder), (f"{TOKENIZER}: {error}",)) from error
    size = tokenizer.get_vocab_size()
    if not 0 <= config.vocabulary - size <= _MOST_PADDING or max(config.end_ids) >= size:
        fault = (
            f"{TOKENIZER} has {size} tokens, expected {config.vocabulary} with {config.end_ids} "
            f"among them as {GENAI_CONFIG} says: it is another model's"
        )
        raise ModelMismatch(str(folder), (fault,))
    guide = LLTokenizer(text, n_vocab=config.vocabulary, eos_token=config.end_ids[0])
    return tokenizer, guide


class ChatTemplate:
    """Write a conversation as a model was trained to read it."""

    def __init__(self, folder: Path) -> None:
        """Read the template.

        Raises:
            ModelMismatch: there is none, or it is no template.
        """
        self._folder = folder
        config = _json_object(folder, CONFIG)
        self._tokens = {name: _text_of(config.get(name)) for name in ("bos_token", "eos_token")}
        environment = ImmutableSandboxedEnvironment(trim_blocks=True, lstrip_blocks=True)
        environment.globals["raise_exception"] = _refuse
        environment.filters["tojson"] = json.dumps
        file = folder / TEMPLATE
        text = file.read_text("utf-8") if file.is_file() else config.get("chat_template")
        if not isinstance(text, str):
            fault = f"no chat template in {TEMPLATE} or {CONFIG}; take the model's instruct form"
            raise ModelMismatch(str(folder), (fault,))
        try:
            self._template: Template = environment.from_string(text)
        except TemplateError as error:
            raise ModelMismatch(str(folder), (f"chat template: {error}",)) from error

    def prompt(self, messages: Sequence[Message]) -> str:
        """Return the text that asks for the answer to the last message.

        Raises:
            ModelMismatch: the template does not take these messages.
        """
        try:
            return self._template.render(
                messages=[dict(one) for one in messages], add_generation_prompt=True, **self._tokens
            )
        except (TemplateError, TypeError, KeyError) as error:
            fault = f"chat template does not take these messages: {error}"
            raise ModelMismatch(str(self._folder), (fault,)) from error


def _json_object(folder: Path, name: str) -> Mapping[str, Any]:
    try:
        document = json.loads((folder / name).read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, json.JSONDecodeError) as error:
        raise ModelMismatch(str(folder), (f"{name}: {error}",)) from error
    if not isinstance(document, dict):
        raise ModelMismatch(str(folder), (f"{name}: expected an object",))
    return document


def _text_of(token: object) -> str:
    """Return a special token that is written as text or as an object."""
    content = token.get("content") if isinstance(token, dict) else token
    return content if isinstance(content, str) else ""


def _refuse(message: str) -> str:
    raise TemplateError(message)
