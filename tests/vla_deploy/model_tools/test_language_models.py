"""A person's language model is tried out before it is kept, checked and measured afterwards."""

import json
import shutil
from pathlib import Path

import pytest

from vla_deploy.cli.main import main
from vla_deploy.inference.errors import ModelFileSpoiled, ModelMismatch, ModelUnknown
from vla_deploy.inference.language_model import open_language_model
from vla_deploy.inference.manifest import LanguageUse
from vla_deploy.inference.opening import PLAIN_CHOICE
from vla_deploy.inference.roles import ModelShelf
from vla_deploy.model_tools.language_models import (
    LanguageModelSource,
    add_language_model,
    bench,
)
from vla_deploy.model_tools.verifying import verify


@pytest.fixture(params=["llama", "qwen2"])
def folder(request: pytest.FixtureRequest, folders: dict[str, Path]) -> Path:
    return folders[request.param]


def source(folder: Path) -> LanguageModelSource:
    return LanguageModelSource(
        name="mine", folder=folder, most_tokens=64, summary="tiny", licence="MIT"
    )


def test_a_model_is_kept_after_it_has_answered(shelf: ModelShelf, folder: Path) -> None:
    model, answer = add_language_model(shelf.store, source(folder), clock=shelf.clock)
    assert set(json.loads(answer.text)) == {"skill", "place"}
    assert model.manifest.language is not None
    assert model.manifest.language.use is LanguageUse.CHAT
    assert shelf.store.load("mine").manifest == model.manifest
    assert {part.path for part in model.manifest.parts} == {
        "genai_config.json", "tokenizer.json", "tokenizer_config.json", "model.onnx",
    }  # fmt: skip


def test_a_name_is_not_taken_twice_unasked(shelf: ModelShelf, folder: Path) -> None:
    add_language_model(shelf.store, source(folder), clock=shelf.clock)
    with pytest.raises(ModelUnknown, match="already"):
        add_language_model(shelf.store, source(folder), clock=shelf.clock)
    add_language_model(shelf.store, source(folder), clock=shelf.clock, replace=True)


def test_nothing_is_kept_of_a_folder_that_is_not_whole(
    shelf: ModelShelf, folder: Path, tmp_path: Path
) -> None:
    half = Path(shutil.copytree(folder, tmp_path / "half"))
    graph = half / "model.onnx"
    graph.write_bytes(graph.read_bytes()[:1000])
    with pytest.raises(ModelFileSpoiled):
        add_language_model(shelf.store, source(half), clock=shelf.clock)
    graph.unlink()
    with pytest.raises(ModelMismatch, match=r"model\.onnx is missing"):
        add_language_model(shelf.store, source(half), clock=shelf.clock)
    assert shelf.store.names() == ()


def test_a_file_that_was_cut_off_later_is_found(shelf: ModelShelf, folder: Path) -> None:
    model, _ = add_language_model(shelf.store, source(folder), clock=shelf.clock)
    assert all(one.is_ok for one in verify(shelf, "mine"))
    file = model.folder / "tokenizer.json"
    file.write_bytes(file.read_bytes()[:-5])
    with pytest.raises(ModelFileSpoiled, match=r"tokenizer\.json"):
        open_language_model(model, PLAIN_CHOICE)
    assert not all(one.is_ok for one in verify(shelf, "mine"))


def test_reading_and_telling_are_measured_apart(shelf: ModelShelf, folder: Path) -> None:
    model, _ = add_language_model(shelf.store, source(folder), clock=shelf.clock)
    figures = bench(model, PLAIN_CHOICE, rounds=2, clock=shelf.clock)
    assert figures["read_tokens_per_s"] > 0.0
    assert figures["told_tokens_per_s"] > 0.0
    assert 0.0 < figures["answer_median_s"] <= figures["answer_p95_s"]


def test_the_command_adds_lists_and_verifies(
    folders: dict[str, Path], tmp_path: Path, capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    base = ["--runtime-base", str(tmp_path / "run"), "models"]
    folder = str(folders["qwen2"])
    assert main([*base, "add", "mine", "--language", folder, "--most-tokens", "64"]) == 0
    assert "it answers {" in capsys.readouterr().out
    assert main([*base, "list", "--json"]) == 0
    rows = {row["name"]: row for row in json.loads(capsys.readouterr().out)}
    assert rows["mine"]["role"] == "planner"
    assert "model.onnx" in rows["mine"]["files"]
    assert main([*base, "verify", "mine", "--profile", "desktop"]) == 0
