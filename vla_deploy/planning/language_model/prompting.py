"""Write a conversation as a model was trained to read it: by the chat template of its folder.

Templates are programs of the model's author; they run in a sandbox that can change nothing.
"""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from jinja2 import TemplateError
from jinja2.sandbox import ImmutableSandboxedEnvironment

from vla_deploy.planning.language_model.errors import ModelFolderInvalid

CONFIG: Final = "tokenizer_config.json"
# Newer exports keep it in a file of its own.
TEMPLATE: Final = "chat_template.jinja"
Message = Mapping[str, str]


class Prompter:
    """Hold one model's chat template."""

    def __init__(self, folder: Path) -> None:
        """Read the template.

        Raises:
            ModelFolderInvalid: there is none, or it is no template.
        """
        self._folder = folder
        config = _config(folder)
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


def _config(folder: Path) -> Mapping[str, Any]:
    file = folder / CONFIG
    try:
        document = json.loads(file.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, json.JSONDecodeError) as error:
        raise ModelFolderInvalid(folder, (f"{CONFIG}: {error}",)) from error
    if not isinstance(document, dict):
        raise ModelFolderInvalid(folder, (f"{CONFIG}: expected an object",))
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
