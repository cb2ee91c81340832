"""Read a model's folder in the layout of onnxruntime-genai: sizes, tensor names, chat template.

Exports of Llama, Qwen, Phi and others differ in heads, names and end tokens; `genai_config.json`
holds all of it. Chat templates are programs of the model's author; they run in a sandbox that can
change nothing.
"""

import json
from collections.abc import Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any, Final

from jinja2 import TemplateError
from jinja2.sandbox import ImmutableSandboxedEnvironment
from pydantic import AliasPath, BaseModel, BeforeValidator, ConfigDict, Field, ValidationError

from vla_deploy.inference.language_schema import GENAI_CONFIG
from vla_deploy.planning.language_model.errors import ModelFolderInvalid

CONFIG: Final = "tokenizer_config.json"
# Newer exports keep it in a file of its own.
TEMPLATE: Final = "chat_template.jinja"
Message = Mapping[str, str]


def _at(*keys: str, default: Any = ...) -> Any:
    """Return a field that stands under these keys of the document's `model`."""
    return Field(default, validation_alias=AliasPath("model", *keys))


_Count = Annotated[int, Field(gt=0, strict=True)]
_TokenId = Annotated[int, Field(ge=0, strict=True)]
_TokenIds = Annotated[
    tuple[_TokenId, ...],
    Field(min_length=1),
    BeforeValidator(lambda given: given if isinstance(given, list) else [given]),
]
_LayerName = Annotated[str, Field(pattern="%d")]


class GenaiConfig(BaseModel):
    """Hold the sizes of a decoder and the names of its tensors.

    `position_ids` is empty where the graph takes none. Tokens in `end_ids` end an answer.
    """

    model_config = ConfigDict(frozen=True)

    vocabulary: _Count = _at("vocab_size")
    context_tokens: _Count = _at("context_length")
    end_ids: _TokenIds = _at("eos_token_id")
    file_name: str = _at("decoder", "filename")
    head_size: _Count = _at("decoder", "head_size")
    layers: _Count = _at("decoder", "num_hidden_layers")
    kv_heads: _Count = _at("decoder", "num_key_value_heads")
    input_ids: str = _at("decoder", "inputs", "input_ids", default="input_ids")
    attention_mask: str = _at("decoder", "inputs", "attention_mask", default="attention_mask")
    position_ids: str = _at("decoder", "inputs", "position_ids", default="")
    past_key: _LayerName = _at("decoder", "inputs", "past_key_names")
    past_value: _LayerName = _at("decoder", "inputs", "past_value_names")
    logits: str = _at("decoder", "outputs", "logits", default="logits")
    present_key: _LayerName = _at("decoder", "outputs", "present_key_names")
    present_value: _LayerName = _at("decoder", "outputs", "present_value_names")

    @cached_property
    def past_names(self) -> tuple[str, ...]:
        """Return the inputs that hold key and value of each layer in turn."""
        return self._in_turn(self.past_key, self.past_value)

    @cached_property
    def present_names(self) -> tuple[str, ...]:
        """Return the outputs that hold key and value of each layer, in the same order."""
        return self._in_turn(self.present_key, self.present_value)

    def _in_turn(self, *patterns: str) -> tuple[str, ...]:
        return tuple(pattern % layer for layer in range(self.layers) for pattern in patterns)


def read_genai_config(folder: Path) -> GenaiConfig:
    """Read the file of a model's folder.

    Raises:
        ModelFolderInvalid: it is missing, is no JSON, or lacks something; all faults are listed.
    """
    document = _json_object(folder, GENAI_CONFIG)
    try:
        return GenaiConfig.model_validate(document)
    except ValidationError as error:
        faults = tuple(
            f"{GENAI_CONFIG}: {'.'.join(map(str, one['loc']))}: {one['msg']}"
            for one in error.errors(include_url=False)
        )
        raise ModelFolderInvalid(folder, faults) from error


class ChatTemplate:
    """Write a conversation as a model was trained to read it."""

    def __init__(self, folder: Path) -> None:
        """Read the template.

        Raises:
            ModelFolderInvalid: there is none, or it is no template.
        """
        self._folder = folder
        config = _json_object(folder, CONFIG)
        self._tokens = {
            name: _text_of(config.get(name))
            for name in ("bos_token", "eos_token", "pad_token", "unk_token")
        }
        environment = ImmutableSandboxedEnvironment(trim_blocks=True, lstrip_blocks=True)
        environment.globals["raise_exception"] = _refuse
        environment.filters["tojson"] = json.dumps
        try:
            self._template = environment.from_string(_template(folder, config))
        except TemplateError as error:
            raise ModelFolderInvalid(folder, (f"chat template: {error}",)) from error

    def prompt(self, messages: Sequence[Message]) -> str:
        """Return the text that asks for the answer to the last message.

        Raises:
            ModelFolderInvalid: the template does not take these messages.
        """
        try:
            return self._template.render(
                messages=[dict(one) for one in messages], add_generation_prompt=True, **self._tokens
            )
        except (TemplateError, TypeError, KeyError) as error:
            fault = f"chat template does not take these messages: {error}"
            raise ModelFolderInvalid(self._folder, (fault,)) from error


def _json_object(folder: Path, name: str) -> Mapping[str, Any]:
    try:
        document = json.loads((folder / name).read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, json.JSONDecodeError) as error:
        raise ModelFolderInvalid(folder, (f"{name}: {error}",)) from error
    if not isinstance(document, dict):
        raise ModelFolderInvalid(folder, (f"{name}: expected an object",))
    return document


def _template(folder: Path, config: Mapping[str, Any]) -> str:
    file = folder / TEMPLATE
    if file.is_file():
        return file.read_text(encoding="utf-8")
    given = config.get("chat_template")
    if isinstance(given, list):  # several by name, as of models that take tools
        named = {one.get("name"): one.get("template") for one in given if isinstance(one, dict)}
        given = named.get("default")
    if not isinstance(given, str):
        fault = f"no chat template in {TEMPLATE} or {CONFIG}; take the model's instruct form"
        raise ModelFolderInvalid(folder, (fault,))
    return given


def _text_of(token: object) -> str:
    """Return a special token that is written as text or as an object."""
    content = token.get("content") if isinstance(token, dict) else token
    return content if isinstance(content, str) else ""


def _refuse(message: str) -> str:
    raise TemplateError(message)
