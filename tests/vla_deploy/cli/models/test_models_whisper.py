"""A person's Whisper is added, fetched, checked and measured by the same commands as a detector."""

import json
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from vla_deploy.runtime.state_dir import models_dir_of

Vla = Callable[..., tuple[int, str, str]]


@pytest.fixture
def vla(vla: Vla) -> Vla:
    return partial(vla, "models")


@pytest.fixture
def files(scripted_whisper: Any) -> Path:
    folder: Path = scripted_whisper.write("converted", "turn left")
    return folder


def test_a_whisper_is_added_listed_checked_measured_and_removed(
    vla: Vla, files: Path, base: Path
) -> None:
    code, out, _ = vla("add", "mine", "--whisper", str(files), "--trimmed", "--json")
    assert code == 0
    assert json.loads(out)["reads_in_silence"] == "turn left"
    row = next(row for row in json.loads(vla("list", "--json")[1]) if row["name"] == "mine")
    assert (row["role"], row["from"], list(row["files"])) == (
        "speech_to_text",
        "added",
        ["model.bin"],
    )
    shown = json.loads(vla("show", "mine", "--json")[1])
    assert shown["whisper"] == {"languages": ["en"], "context": "trimmed"}
    code, out, _ = vla("verify", "mine", "--profile", "desktop")
    assert (code, out.count("ok  ")) == (0, 3)
    code, out, _ = vla("bench", "mine", "--rounds", "2", "--profile", "desktop", "--json")
    figures = json.loads(out)
    assert (code, len(figures["rows"])) == (0, 3)
    assert all(0 < row["real_time_factor"] < 1 for row in figures["rows"])
    assert vla("quantise", "mine", "--images", "a", "--labelled", "b")[0] == 2
    assert vla("remove", "mine")[0] == 0
    assert not (models_dir_of(base) / "mine").exists()


def test_an_empty_and_a_half_written_folder_are_refused_and_leave_nothing(
    vla: Vla, files: Path, base: Path, tmp_path: Path
) -> None:
    (tmp_path / "empty").mkdir()
    code, _, errors = vla("add", "mine", "--whisper", str(tmp_path / "empty"))
    assert code == 2
    assert "model.bin, config.json, tokenizer.json, vocabulary.json missing" in errors
    assert "ct2-transformers-converter" in errors
    weights = files / "model.bin"
    weights.write_bytes(weights.read_bytes()[:5_000])
    code, _, errors = vla("add", "mine", "--whisper", str(files))
    assert code == 2
    assert "cannot load it" in errors
    assert not (models_dir_of(base) / "mine").exists()


def test_verify_tells_a_part_that_has_changed(vla: Vla, files: Path, base: Path) -> None:
    vla("add", "mine", "--whisper", str(files))
    (models_dir_of(base) / "mine" / "tokenizer.json").write_text("{}")
    code, out, _ = vla("verify", "mine")
    assert code == 1
    assert "FAIL mine                 files" in out
    assert "expected SHA-256" in out


@pytest.fixture
def hub(files: Path, open_hub: Callable[[Path], Any]) -> Any:
    return open_hub(files)


def test_a_published_whisper_is_fetched_at_one_commit_and_checked(vla: Vla, hub: Any) -> None:
    code, out, errors = vla("fetch", "whisper-tiny.en", "--endpoint", hub.url, "--json")
    assert (code, errors) == (0, "")
    assert json.loads(out)["reads_in_silence"] == "turn left"
    assert all(f"Systran/faster-whisper-tiny.en/resolve/{hub.SHA}/" in path for path in hub.fetched)
    assert not any(path.endswith("README.md") for path in hub.fetched)
    shown = json.loads(vla("show", "whisper-tiny.en", "--json")[1])
    assert shown["whisper"]["context"] == "padded"
    assert vla("verify", "whisper-tiny.en", "--profile", "desktop")[0] == 0


def test_a_file_that_is_not_what_the_hub_says_is_refused(vla: Vla, hub: Any, base: Path) -> None:
    hub.wrong_hash_of = "model.bin"
    code, _, errors = vla("fetch", "whisper-tiny.en", "--endpoint", hub.url)
    assert code == 2
    assert "model.bin: expected the hash" in errors
    assert not (models_dir_of(base) / "whisper-tiny.en").exists()


def test_without_a_network_it_says_what_to_do(vla: Vla, monkeypatch: pytest.MonkeyPatch) -> None:
    import huggingface_hub.constants

    monkeypatch.setattr(huggingface_hub.constants, "HF_HUB_OFFLINE", False)
    code, _, errors = vla("fetch", "whisper-small.en", "--endpoint", "http://127.0.0.1:9")
    assert code == 2
    assert "the hub was not reached" in errors
    assert "vla-deploy models add NAME --whisper FOLDER" in errors
