"""A published language model is one command away, checked by what the hub says of each file."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from vla_deploy.cli.main import main
from vla_deploy.inference.errors import ModelUnknown
from vla_deploy.inference.manifest_schema import is_name
from vla_deploy.model_tools import hub as hub_client
from vla_deploy.model_tools.published import LANGUAGE_MODELS, WHISPERS, PublishedModel
from vla_deploy.runtime.state_dir import models_dir_of

Vla = Callable[..., tuple[int, str, str]]
NAME = "llama-3.2-1b-cpu"
FOLDER = LANGUAGE_MODELS[NAME].folder


@pytest.fixture
def vla(tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> Vla:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))

    def vla(*arguments: str) -> tuple[int, str, str]:
        code = main(["--runtime-base", str(tmp_path / "base"), "models", *arguments])
        told = capsys.readouterr()
        return code, told.out, told.err

    return vla


@pytest.fixture
def hub(folders: dict[str, Path], open_hub: Callable[..., Any]) -> Any:
    return open_hub(folders["qwen2"], FOLDER)


def test_a_published_model_is_fetched_at_one_commit_checked_tried_out_and_kept(
    vla: Vla, hub: Any
) -> None:
    given = ("--endpoint", hub.url, "--profile", "desktop", "--most-tokens", "64")
    code, out, errors = vla("fetch", NAME, *given)
    assert code == 0
    assert "it answers {" in out
    assert f'tiers = ["{NAME}", "command_parser"]' in out
    assert f"fetching {FOLDER}/model.onnx, 0.000 GB" in errors
    at = f"/{LANGUAGE_MODELS[NAME].repository}/resolve/{hub.SHA}/{FOLDER}/"
    assert {path.removeprefix(at) for path in hub.fetched} == {
        "genai_config.json", "tokenizer.json", "tokenizer_config.json", "model.onnx",
    }  # fmt: skip
    shown = json.loads(vla("show", NAME, "--json")[1])
    assert (shown["licence"], shown["language"]["most_tokens"]) == (
        LANGUAGE_MODELS[NAME].licence,
        64,
    )
    code, out, _ = vla("verify", NAME, "--profile", "desktop")
    assert (code, out.count("ok  ")) == (0, 3)
    code, _, errors = vla("fetch", NAME, *given)
    assert (code, "already" in errors) == (2, True), "and nothing is fetched again"


def test_any_repository_is_fetched_under_a_name_with_the_licence_that_it_states(
    vla: Vla, hub: Any
) -> None:
    place = f"somebody/anything:{FOLDER}"
    given = ("--endpoint", hub.url, "--profile", "desktop", "--revision", "v2", "--json")
    code, out, errors = vla("fetch", "--language", place, "--as", "mine", *given)
    assert (code, errors, json.loads(out)["name"]) == (0, "", "mine")
    assert any(path.startswith("/api/models/somebody/anything/revision/v2") for path in hub.asked)
    shown = json.loads(vla("show", "mine", "--json")[1])
    assert shown["licence"] == "mit"
    assert shown["summary"].endswith(place)


def test_a_folder_without_a_model_is_told_with_those_that_have_one(vla: Vla, hub: Any) -> None:
    place = ("--language", "somebody/anything", "--as", "mine", "--endpoint", hub.url)
    code, _, errors = vla("fetch", *place)
    assert code == 2
    assert f"no genai_config.json lies there; expected the layout of onnxruntime-genai, which is " \
        f"in: {FOLDER}" in errors  # fmt: skip
    assert hub.fetched == []


@pytest.mark.parametrize("name", ["model.onnx", "tokenizer.json"])
def test_a_file_that_is_not_what_the_hub_says_is_refused(
    vla: Vla, hub: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    hub.wrong_hash_of = name
    if name == "tokenizer.json":
        served = hub.answer
        monkeypatch.setattr(
            hub, "answer", lambda path: served(path) + b" " * path.endswith(f"/{name}")
        )
    code, _, errors = vla("fetch", NAME, "--endpoint", hub.url)
    assert code == 2
    assert f"{name}: expected the hash" in errors
    assert list(models_dir_of(tmp_path / "base").iterdir()) == []


def test_a_disk_that_is_too_small_is_told_before_anything_is_fetched(
    vla: Vla, hub: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    usage = hub_client.shutil.disk_usage("/")._replace(free=1000)
    monkeypatch.setattr(hub_client.shutil, "disk_usage", lambda _: usage)
    code, _, errors = vla("fetch", NAME, "--endpoint", hub.url)
    assert (code, "make room, or choose a smaller model" in errors) == (2, True)
    assert hub.fetched == []


@pytest.mark.parametrize(
    ("given", "why"),
    [
        ((), "expected the NAME of a published model"),
        ((NAME, "--language", "a/b"), "expected the NAME of a published model"),
        (("--language", "a/b"), "expected --as NAME"),
        (("--language", "a", "--as", "mine"), "expected OWNER/REPO or OWNER/REPO:FOLDER"),
        (("whisper-tiny.en", "--as", "mine"), "are for language models"),
        ((NAME, "--endpoint", "http://127.0.0.1:9"), "models add NAME --language FOLDER"),
    ],
)
def test_what_is_missing_or_wrong_is_told(
    vla: Vla, monkeypatch: pytest.MonkeyPatch, given: tuple[str, ...], why: str
) -> None:
    import huggingface_hub.constants

    monkeypatch.setattr(huggingface_hub.constants, "HF_HUB_OFFLINE", False)
    code, _, errors = vla("fetch", *given)
    assert (code, why in errors) == (2, True), errors


@pytest.mark.parametrize("place", ["", "a", "a/b/c", "/b", "a/", "a/b:/etc", "a/b:x/../y"])
def test_a_place_that_is_none_is_refused(place: str) -> None:
    with pytest.raises(ModelUnknown, match="OWNER/REPO"):
        PublishedModel.named(place)


@pytest.mark.parametrize("name", [*LANGUAGE_MODELS, *WHISPERS])
def test_the_table_names_each_model_so_that_it_can_be_kept(name: str) -> None:
    one = {**LANGUAGE_MODELS, **WHISPERS}[name]
    assert is_name(name)
    assert PublishedModel.named(str(one)).folder == one.folder
    assert one.licence
