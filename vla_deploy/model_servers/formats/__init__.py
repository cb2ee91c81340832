"""Speak the languages of model servers, by the name that `servers.toml` uses."""

from collections.abc import Mapping
from typing import Final

from vla_deploy.model_servers.formats.anthropic_messages import AnthropicMessages
from vla_deploy.model_servers.formats.base import Format
from vla_deploy.model_servers.formats.ollama_chat import OllamaChat
from vla_deploy.model_servers.formats.openai_chat import OpenAiChat
from vla_deploy.model_servers.settings import Api

FORMATS: Final[Mapping[Api, Format]] = {
    Api.OPENAI_COMPATIBLE: OpenAiChat("max_tokens"),
    Api.OLLAMA: OllamaChat(),
    Api.OPENAI: OpenAiChat("max_completion_tokens"),
    Api.ANTHROPIC: AnthropicMessages(),
}
