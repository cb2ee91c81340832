import base64
from typing import Literal

import pytest
from pydantic import BaseModel, Field

from vla_deploy.model_servers.chat import Chat, ChatMessage, ChatRole
from vla_deploy.model_servers.errors import AnswerMalformed, AnswerRefused, AnswerTruncated
from vla_deploy.model_servers.formats import FORMATS
from vla_deploy.model_servers.formats.base import is_closed, wire_schema
from vla_deploy.model_servers.settings import Api
from vla_deploy.runtime.secret import Secret

JPEG = b"\xff\xd8 an image"
BASE64 = base64.b64encode(JPEG).decode()


class Thing(BaseModel):
    name: str = Field(max_length=20)
    width_m: float = Field(default=0.1, ge=0.0)
    side: Literal["left", "right"]


class Things(BaseModel):
    things: list[Thing] = Field(max_length=3)


SCHEMA = Things.model_json_schema()
CHAT = Chat(
    system="be brief",
    messages=(
        ChatMessage(text="what is it?", images=(JPEG,)),
        ChatMessage(role=ChatRole.ASSISTANT, text="a cup"),
        ChatMessage(text="sure?"),
    ),
    schema=SCHEMA,
    schema_name="things",
)


@pytest.fixture
def body(settings):
    """Return the body of a request in one of the languages."""

    def body(api: Api, mode: int = 0, chat: Chat = CHAT, **changes):
        format_ = FORMATS[api]
        declared = settings("http://127.0.0.1:9", api=api, **changes)
        return format_.request(declared, chat, format_.schema_modes[mode]).body

    return body


def test_openai_gets_images_as_data_urls_and_a_strict_schema(body):
    sent = body(Api.OPENAI)
    assert sent["messages"][0] == {"role": "system", "content": "be brief"}
    assert sent["messages"][1]["content"][0] == {
        "type": "image_url",
        "image_url": {"url": f"data:image/jpeg;base64,{BASE64}"},
    }
    assert sent["messages"][2] == {"role": "assistant", "content": "a cup"}
    assert sent["response_format"]["type"] == "json_schema"
    assert sent["response_format"]["json_schema"]["strict"] is True
    assert sent["max_completion_tokens"] == 2048
    assert "temperature" not in sent


def test_compatible_servers_get_the_older_name_of_the_token_bound(body):
    sent = body(Api.OPENAI_COMPATIBLE, temperature=0.0)
    assert (sent["max_tokens"], sent["temperature"]) == (2048, 0.0)
    assert "max_completion_tokens" not in sent


def test_the_second_mode_is_the_form_that_llama_cpp_python_takes(body):
    assert body(Api.OPENAI_COMPATIBLE, 1)["response_format"] == {
        "type": "json_object",
        "schema": wire_schema(SCHEMA),
    }


def test_ollama_gets_images_beside_the_text_and_the_schema_as_format(body):
    sent = body(Api.OLLAMA, temperature=0.5)
    assert sent["messages"][1] == {"role": "user", "content": "what is it?", "images": [BASE64]}
    assert sent["format"] == wire_schema(SCHEMA)
    assert sent["stream"] is False
    assert sent["options"] == {"num_predict": 2048, "temperature": 0.5}
    assert body(Api.OLLAMA, 1)["format"] == "json"


def test_anthropic_gets_image_blocks_and_the_schema_as_output_format(body):
    sent = body(Api.ANTHROPIC)
    assert sent["system"] == "be brief"
    assert sent["messages"][0]["content"][0] == {
        "type": "image",
        "source": {"type": "base64", "media_type": "image/jpeg", "data": BASE64},
    }
    assert sent["output_config"]["format"] == {
        "type": "json_schema",
        "schema": wire_schema(SCHEMA),
    }
    tool = body(Api.ANTHROPIC, 1)
    assert tool["tools"][0]["input_schema"] == wire_schema(SCHEMA)
    assert tool["tool_choice"] == {"type": "tool", "name": "things"}


@pytest.mark.parametrize("api", Api)
def test_the_last_mode_asks_in_words_alone(body, api):
    assert not {"response_format", "format", "output_config", "tools"} & body(api, -1).keys()


def test_keys_travel_in_the_header_of_each_language():
    key = Secret("sk-1")
    assert FORMATS[Api.OPENAI].headers(key) == {"Authorization": "Bearer sk-1"}
    assert FORMATS[Api.ANTHROPIC].headers(key) == {
        "anthropic-version": "2023-06-01",
        "x-api-key": "sk-1",
    }
    assert FORMATS[Api.OLLAMA].headers(None) == {}


OPENAI_REPLY = {
    "choices": [{"message": {"role": "assistant", "content": "hello"}, "finish_reason": "stop"}],
    "usage": {"prompt_tokens": 5, "completion_tokens": 2},
}
OLLAMA_REPLY = {
    "message": {"role": "assistant", "content": "hello"},
    "done": True,
    "done_reason": "stop",
    "prompt_eval_count": 5,
    "eval_count": 2,
}
ANTHROPIC_REPLY = {
    "content": [{"type": "thinking", "thinking": "hm"}, {"type": "text", "text": "hello"}],
    "stop_reason": "end_turn",
    "usage": {"input_tokens": 5, "output_tokens": 2},
}
REPLIES = {
    Api.OPENAI: OPENAI_REPLY,
    Api.OPENAI_COMPATIBLE: OPENAI_REPLY,
    Api.OLLAMA: OLLAMA_REPLY,
    Api.ANTHROPIC: ANTHROPIC_REPLY,
}


@pytest.mark.parametrize("api", Api)
def test_a_right_reply_gives_text_and_tokens(api):
    completion = FORMATS[api].completion(REPLIES[api])
    assert (completion.text, completion.tokens_in, completion.tokens_out) == ("hello", 5, 2)


@pytest.mark.parametrize("api", Api)
@pytest.mark.parametrize("reply", [{}, {"choices": []}, {"message": "hi"}, {"content": "hi"}])
def test_a_reply_of_another_language_is_malformed(api, reply):
    with pytest.raises(AnswerMalformed):
        FORMATS[api].completion(reply)


def test_a_tool_s_arguments_are_the_answer():
    blocks = [{"type": "tool_use", "name": "things", "input": {"things": []}}]
    reply = {**ANTHROPIC_REPLY, "content": blocks, "stop_reason": "tool_use"}
    assert FORMATS[Api.ANTHROPIC].completion(reply).text == '{"things": []}'


def _openai(finish: str, **message):
    return {"choices": [{"message": {"content": "{", **message}, "finish_reason": finish}]}


@pytest.mark.parametrize(
    ("api", "reply", "error"),
    [
        (Api.OPENAI, _openai("length"), AnswerTruncated),
        (Api.OPENAI, _openai("stop", refusal="I can't help with that."), AnswerRefused),
        (Api.OPENAI, _openai("content_filter"), AnswerRefused),
        (Api.OLLAMA, OLLAMA_REPLY | {"done_reason": "length"}, AnswerTruncated),
        (Api.OLLAMA, OLLAMA_REPLY | {"done": False}, AnswerTruncated),
        (Api.ANTHROPIC, ANTHROPIC_REPLY | {"stop_reason": "max_tokens"}, AnswerTruncated),
        (Api.ANTHROPIC, {"content": [], "stop_reason": "refusal"}, AnswerRefused),
    ],
)
def test_refused_and_truncated_answers_are_told_apart(api, reply, error):
    with pytest.raises(error):
        FORMATS[api].completion(reply)


@pytest.mark.parametrize(
    ("api", "model", "replies", "present", "vision"),
    [
        (Api.OPENAI, "a", ({"data": [{"id": "a"}, {"id": "b"}]},), True, None),
        (Api.OPENAI, "c", ({"data": [{"id": "a"}]},), False, None),
        (
            Api.OPENAI_COMPATIBLE,
            "a",
            ({"data": [{"id": "a"}], "models": [{"name": "a", "capabilities": ["multimodal"]}]},),
            True,
            True,
        ),
        (
            Api.OLLAMA,
            "llava",
            ({"models": [{"name": "llava:latest"}]}, {"capabilities": ["completion", "vision"]}),
            True,
            True,
        ),
        (Api.OLLAMA, "llava:7b", ({"models": [{"name": "llava:latest"}]}, None), False, None),
        (Api.ANTHROPIC, "claude", ({"id": "claude-1"},), True, None),
        (Api.ANTHROPIC, "claude", (None,), False, None),
    ],
)
def test_what_a_server_tells_of_its_models_is_read(settings, api, model, replies, present, vision):
    facts = FORMATS[api].facts(settings("http://h:9", api=api, model=model), replies)
    assert (facts.is_present, facts.has_vision) == (present, vision)


def test_a_wire_schema_is_closed_and_free_of_bounds():
    reduced = wire_schema(SCHEMA)
    thing = reduced["$defs"]["Thing"]
    assert thing["required"] == ["name", "width_m", "side"]
    assert thing["additionalProperties"] is False
    assert thing["properties"]["name"] == {"type": "string"}
    assert thing["properties"]["side"]["enum"] == ["left", "right"]
    assert is_closed(reduced)


def test_free_tables_are_not_closed():
    class Free(BaseModel):
        parameters: dict[str, str]

    assert not is_closed(wire_schema(Free.model_json_schema()))
