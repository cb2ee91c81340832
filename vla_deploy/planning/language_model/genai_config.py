"""Read `genai_config.json`: how a model of the layout of onnxruntime-genai wants to be fed.

Exports of Llama, Qwen, Phi and others differ in heads, names and end tokens; all of it is there.
"""

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from vla_deploy.inference.language_schema import GENAI_CONFIG
from vla_deploy.planning.language_model.errors import ModelFolderInvalid

_NUMBERS: Final = ("vocab_size", "context_length")
_DECODER_NUMBERS: Final = ("head_size", "num_hidden_layers", "num_key_value_heads")
_PATTERNS: Final = (
    ("inputs", "past_key_names"), ("inputs", "past_value_names"),
    ("outputs", "present_key_names"), ("outputs", "present_value_names"),
)  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True)
class GenaiConfig:
    """Hold the sizes of a decoder and the names of its tensors.

    `past_names` and `present_names` hold key and value of each layer in turn, in the same order.
    `position_ids` is empty where the graph takes none. Tokens in `end_ids` end an answer.
    """

    file_name: str
    vocabulary: int
    context_tokens: int
    kv_heads: int
    head_size: int
    end_ids: tuple[int, ...]
    input_ids: str
    attention_mask: str
    position_ids: str
    logits: str
    past_names: tuple[str, ...]
    present_names: tuple[str, ...]


def read_genai_config(folder: Path) -> GenaiConfig:
    """Read the file of a model's folder.

    Raises:
        ModelFolderInvalid: it is missing, is no JSON, or lacks something; all faults are listed.
    """
    file = folder / GENAI_CONFIG
    try:
        document = json.loads(file.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, json.JSONDecodeError) as error:
        raise ModelFolderInvalid(folder, (f"{GENAI_CONFIG}: {error}",)) from error
    faults = tuple(_faults(document))
    if faults:
        raise ModelFolderInvalid(folder, faults)
    return _build(document["model"])


def _faults(document: Any) -> Iterator[str]:
    model = _table(document, "model")
    decoder = _table(model, "decoder")
    if not decoder:
        yield f"{GENAI_CONFIG}: expected model.decoder, got none; only text decoders are run"
        return
    for table, where, names in ((model, "model", _NUMBERS), (decoder, "decoder", _DECODER_NUMBERS)):
        for name in names:
            if not _is_count(table.get(name)):
                yield _fault(f"{where}.{name}", "an integer above 0", table.get(name))
    if not isinstance(decoder.get("filename"), str):
        yield _fault("decoder.filename", "a name", decoder.get("filename"))
    if not _end_ids(model):
        yield _fault("model.eos_token_id", "a token, or a list of them", model.get("eos_token_id"))
    for group, name in _PATTERNS:
        pattern = _table(decoder, group).get(name)
        if not isinstance(pattern, str) or "%d" not in pattern:
            yield _fault(f"decoder.{group}.{name}", "a name with %d", pattern)


def _fault(key: str, expected: str, got: object) -> str:
    return f"{GENAI_CONFIG}: {key}: expected {expected}, got {got!r}"


def _build(model: Mapping[str, Any]) -> GenaiConfig:
    decoder = model["decoder"]
    inputs, outputs = decoder["inputs"], decoder["outputs"]
    layers = range(decoder["num_hidden_layers"])

    def in_turn(names: Mapping[str, str], key: str, value: str) -> tuple[str, ...]:
        pairs = ((names[key] % layer, names[value] % layer) for layer in layers)
        return tuple(name for pair in pairs for name in pair)

    return GenaiConfig(
        file_name=decoder["filename"],
        vocabulary=model["vocab_size"],
        context_tokens=model["context_length"],
        kv_heads=decoder["num_key_value_heads"],
        head_size=decoder["head_size"],
        end_ids=_end_ids(model),
        input_ids=inputs.get("input_ids", "input_ids"),
        attention_mask=inputs.get("attention_mask", "attention_mask"),
        position_ids=inputs.get("position_ids", ""),
        logits=outputs.get("logits", "logits"),
        past_names=in_turn(inputs, "past_key_names", "past_value_names"),
        present_names=in_turn(outputs, "present_key_names", "present_value_names"),
    )


def _end_ids(model: Mapping[str, Any]) -> tuple[int, ...]:
    given = model.get("eos_token_id")
    listed: list[Any] = given if isinstance(given, list) else [given]
    return tuple(listed) if all(isinstance(one, int) and one >= 0 for one in listed) else ()


def _table(document: Any, key: str) -> Mapping[str, Any]:
    found = document.get(key) if isinstance(document, dict) else None
    return found if isinstance(found, dict) else {}


def _is_count(value: object) -> bool:
    return isinstance(value, int) and not isinstance(value, bool) and value > 0
