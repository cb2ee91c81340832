"""One path runs every family: answers of a schema, the same however they are made, bounded."""

import json
import shutil
from collections.abc import Callable, Sequence
from pathlib import Path
from threading import Event
from typing import Any

import numpy as np
import onnx
import pytest

from drivers.clock import MonotonicClock
from vla_deploy.inference.errors import AnswerFailed, ModelFileSpoiled, ModelMismatch
from vla_deploy.inference.language_model import (
    AnswerBounds,
    LanguageModel,
)
from vla_deploy.inference.language_model import model as model_module
from vla_deploy.inference.language_model.decoding import Constraint
from vla_deploy.runtime.deadline import Deadline

SCHEMA = {
    "type": "object",
    "properties": {"do": {"enum": ["go", "wait"]}, "seconds": {"enum": [1, 2, 30]}},
    "required": ["do", "seconds"],
    "additionalProperties": False,
}
Open = Callable[[Path], LanguageModel]
ASKED = [{"role": "user", "content": "go to the kitchen"}]


class StepByStep(Constraint):
    """Force nothing, so that the model is asked for every token."""

    def forced(self) -> list[int]:
        return []


def bounds(
    most_tokens: int = 64, within_s: float = 30.0, recall: Event | None = None
) -> AnswerBounds:
    deadline = Deadline.within(MonotonicClock(), within_s, recall)
    return AnswerBounds(deadline=deadline, most_tokens=most_tokens)


def prompt_of(model: LanguageModel, text: str) -> list[int]:
    numbers: list[int] = model.tokenizer.encode(text).ids
    return numbers


def test_an_answer_is_json_of_the_schema_even_from_random_weights(model: LanguageModel) -> None:
    answer = model.answer(ASKED, bounds(), SCHEMA)
    told = json.loads(answer.text)
    assert told["do"] in ("go", "wait")
    assert told["seconds"] in (1, 2, 30)
    assert " " not in answer.text


def test_forced_tokens_change_the_runs_and_not_the_answer(model: LanguageModel) -> None:
    prompt = prompt_of(model, "go to the kitchen")
    with_forced, by_step = (
        model.generate(prompt, kind(model.guide, SCHEMA), bounds())
        for kind in (Constraint, StepByStep)
    )
    assert with_forced.text == by_step.text
    assert with_forced.runs < by_step.runs


def test_the_same_prompt_gives_the_same_answer_and_is_read_once(model: LanguageModel) -> None:
    first = model.answer(ASKED, bounds(), SCHEMA)
    second = model.answer(ASKED, bounds(), SCHEMA)
    assert second.text == first.text
    assert (first.reused_tokens, second.reused_tokens) == (0, first.prompt_tokens - 1)


def test_what_is_remembered_gives_the_scores_of_the_whole_text(model: LanguageModel) -> None:
    text = prompt_of(model, "pick it up, go to the kitchen")
    at_once = model.decoder.feed(text)
    model.decoder.keep(text[:1])
    piecewise = [model.decoder.feed([token]) for token in text][-1]
    np.testing.assert_allclose(piecewise, at_once, rtol=1e-4, atol=1e-4)


def test_another_ending_is_read_from_where_the_prompts_part(model: LanguageModel) -> None:
    text, other = prompt_of(model, "go to the kitchen"), prompt_of(model, "go to it")
    model.decoder.feed(text)
    same = model.decoder.keep(other)
    assert 0 < same < len(text)
    parted = model.decoder.feed(other[same:])
    model.decoder.keep([])
    np.testing.assert_allclose(parted, model.decoder.feed(other), rtol=1e-4, atol=1e-4)


def test_a_long_prompt_is_read_in_pieces_with_the_same_answer(
    model: LanguageModel, monkeypatch: pytest.MonkeyPatch
) -> None:
    at_once = model.answer(ASKED, bounds(), SCHEMA)
    model.decoder.keep([])
    monkeypatch.setattr(model_module, "PIECE_TOKENS", 16)
    piecewise = model.answer(ASKED, bounds(), SCHEMA)
    assert piecewise.text == at_once.text
    assert piecewise.runs - at_once.runs == (at_once.prompt_tokens - 1) // 16


def test_a_recalled_prompt_is_not_read_to_its_end(
    model: LanguageModel, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(model_module, "PIECE_TOKENS", 16)
    recall, feed = Event(), model.decoder.feed

    def read(tokens: Sequence[int]) -> Any:
        recall.set()
        return feed(tokens)

    monkeypatch.setattr(model.decoder, "feed", read)
    with pytest.raises(AnswerFailed, match="nobody waits"):
        model.answer(ASKED, bounds(recall=recall), SCHEMA)
    assert len(model.decoder.tokens) == 16


def recalled() -> Event:
    event = Event()
    event.set()
    return event


@pytest.mark.parametrize(
    ("limits", "asked", "schema", "why"),
    [
        ({"within_s": 0.0}, ASKED, SCHEMA, "time is up"),
        ({"recall": recalled()}, ASKED, SCHEMA, "nobody waits"),
        ({"most_tokens": 3}, ASKED, SCHEMA, "3 tokens"),
        ({}, [{"role": "user", "content": "kitchen " * 300}], SCHEMA, "256 at most"),
        ({}, ASKED, {"type": "nonsense"}, "the constraint broke"),
    ],
    ids=["no time", "recalled", "too long", "prompt beyond the context", "no schema"],
)
def test_an_answer_that_cannot_be_whole_is_an_error(
    model: LanguageModel, limits: Any, asked: Any, schema: Any, why: str
) -> None:
    with pytest.raises(AnswerFailed, match=why):
        model.answer(asked, bounds(**limits), schema)


def test_a_model_answers_again_after_a_refused_prompt(model: LanguageModel) -> None:
    before = model.answer(ASKED, bounds(), SCHEMA).text
    with pytest.raises(AnswerFailed):
        model.answer([{"role": "user", "content": "kitchen " * 300}], bounds(), SCHEMA)
    assert model.answer(ASKED, bounds(), SCHEMA).text == before


def test_the_closing_brace_ends_the_answer_without_an_end_token(model: LanguageModel) -> None:
    constraint = Constraint(model.guide, SCHEMA)
    tokens = prompt_of(model, '{"do":"go","seconds":30}')
    constraint.take(tokens[:-1])
    assert not constraint.is_done
    constraint.take(tokens[-1:])
    assert constraint.is_done


def test_no_blank_may_stand_between_the_parts(model: LanguageModel) -> None:
    constraint = Constraint(model.guide, SCHEMA)
    constraint.take(prompt_of(model, "{"))
    allowed = constraint.allowed(model.config.vocabulary)
    for blank in (" ", "\t", "\n"):
        assert not allowed[prompt_of(model, blank)[0]]


def test_templates_speak_as_the_families_do(opened: Open, folders: dict[str, Path]) -> None:
    chat = [{"role": "system", "content": "be brief"}, {"role": "user", "content": " hi "}]
    llama = opened(folders["llama"]).template.prompt(chat)
    qwen = opened(folders["qwen2"]).template.prompt(chat)
    assert llama == (
        "<|begin|><|start_header_id|>system<|end_header_id|>\n\nbe brief<|eot_id|>"
        "<|start_header_id|>user<|end_header_id|>\n\nhi<|eot_id|>"
        "<|start_header_id|>assistant<|end_header_id|>\n\n"
    )
    assert qwen.endswith("<|im_start|>user\n hi <|im_end|>\n<|im_start|>assistant\n")


# --- folders that are not whole -------------------------------------------------------------------


@pytest.fixture
def copied(folders: dict[str, Path], tmp_path: Path) -> Path:
    return Path(shutil.copytree(folders["qwen2"], tmp_path / "qwen2"))


def rewrite(file: Path, change: Any) -> None:
    document = json.loads(file.read_text())
    change(document)
    file.write_text(json.dumps(document))


@pytest.mark.parametrize("name", ["genai_config.json", "tokenizer.json", "tokenizer_config.json"])
def test_a_missing_file_is_named(opened: Open, copied: Path, name: str) -> None:
    (copied / name).unlink()
    with pytest.raises(ModelMismatch, match=name):
        opened(copied)


def test_a_half_written_graph_is_named(opened: Open, copied: Path) -> None:
    file = copied / "model.onnx"
    file.write_bytes(file.read_bytes()[: file.stat().st_size // 2])
    with pytest.raises(ModelFileSpoiled, match=r"model\.onnx"):
        opened(copied)


def test_every_fault_of_the_configuration_is_told(opened: Open, copied: Path) -> None:
    def spoil(document: Any) -> None:
        del document["model"]["vocab_size"], document["model"]["decoder"]["filename"]
        document["model"]["context_length"] = "long"

    rewrite(copied / "genai_config.json", spoil)
    with pytest.raises(ModelMismatch) as refused:
        opened(copied)
    assert len(refused.value.faults) == 3


def test_the_tokenizer_of_another_model_is_refused(opened: Open, copied: Path) -> None:
    def grow(document: Any) -> None:
        document["model"]["vocab_size"] = 32_000

    rewrite(copied / "genai_config.json", grow)
    with pytest.raises(ModelMismatch, match="another model's"):
        opened(copied)


def test_tensors_that_the_graph_lacks_are_named(opened: Open, copied: Path) -> None:
    file = copied / "model.onnx"
    graph = onnx.load(file)
    del graph.graph.output[1]
    onnx.save(graph, file)
    with pytest.raises(ModelMismatch, match=r"no present\.0\.key"):
        opened(copied)


def test_a_template_cannot_reach_beyond_its_sandbox(opened: Open, copied: Path) -> None:
    def plot(document: Any) -> None:
        document["chat_template"] = "{{ messages.__class__.__mro__[1].__subclasses__() }}"

    rewrite(copied / "tokenizer_config.json", plot)
    with pytest.raises(ModelMismatch, match="does not take these messages"):
        opened(copied).answer(ASKED, bounds(), SCHEMA)


def test_a_model_without_a_template_is_no_chat_model(opened: Open, copied: Path) -> None:
    rewrite(copied / "tokenizer_config.json", lambda document: document.pop("chat_template"))
    with pytest.raises(ModelMismatch, match="instruct form"):
        opened(copied)
