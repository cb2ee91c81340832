"""A person's text embedder is tried out, kept, and then the memory is searched by meaning."""

import json
from collections.abc import Callable, Mapping, Sequence
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
import onnx
import pytest
from onnx import TensorProto, helper, numpy_helper

from vla_deploy.cli.main import main
from vla_deploy.inference.errors import InferenceError, ModelMismatch, RunFailed
from vla_deploy.inference.manifest import Pooling
from vla_deploy.inference.roles import ModelShelf
from vla_deploy.memory import Episode, EpisodeOutcome, MemoryStore
from vla_deploy.memory.meaning import installed_embedder
from vla_deploy.model_tools.published import TEXT_EMBEDDERS
from vla_deploy.model_tools.text_embedders import TextEmbedderSource, add_text_embedder
from vla_deploy.model_tools.verifying import verify

# Words of one row mean the same; those of none mean nothing.
MEANINGS = (("bring", "fetch"), ("drink", "beverage", "bottle"), ("map", "flat"), ("sofa", "couch"))


def write_embedder(folder: Path, meanings: Sequence[Sequence[str]] = MEANINGS) -> Path:
    """Write a tokenizer of whole words, and a graph that gives each word the row of its meaning."""
    folder.mkdir()
    words = ["[UNK]", *(word for row in meanings for word in row)]
    tokenizer = {
        "version": "1.0",
        "truncation": {"direction": "Right", "max_length": 2, "strategy": "LongestFirst",
                       "stride": 0},
        "padding": None, "added_tokens": [], "normalizer": {"type": "Lowercase"},
        "pre_tokenizer": {"type": "Whitespace"}, "post_processor": None, "decoder": None,
        "model": {"type": "WordLevel", "unk_token": "[UNK]",
                  "vocab": {word: number for number, word in enumerate(words)}},
    }  # fmt: skip
    (folder / "tokenizer.json").write_text(json.dumps(tokenizer))
    table = np.zeros((len(words), len(meanings)), dtype=np.float32)
    for column, row in enumerate(meanings):
        table[[words.index(word) for word in row], column] = 1.0
    graph = helper.make_graph(
        [helper.make_node("Gather", ["table", "input_ids"], ["last_hidden_state"])],
        "embedder",
        [
            helper.make_tensor_value_info(name, TensorProto.INT64, ["batch", "tokens"])
            for name in ("input_ids", "attention_mask")
        ],
        [
            helper.make_tensor_value_info(
                "last_hidden_state", TensorProto.FLOAT, ["batch", "tokens", len(meanings)]
            )
        ],
        [numpy_helper.from_array(table, "table")],
    )
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=8)
    onnx.save(model, str(folder / "model.onnx"))
    return folder


def source(folder: Path, **changes: object) -> TextEmbedderSource:
    given: Mapping[str, object] = {
        "name": "tiny", "folder": folder, "summary": "tiny", "licence": "MIT",
        "pooling": Pooling.MEAN, "most_tokens": 64, "least_cosine": 0.3, **changes,
    }  # fmt: skip
    return TextEmbedderSource(**given)  # type: ignore[arg-type]


def test_it_is_kept_once_it_tells_one_meaning_from_another(
    shelf: ModelShelf, tmp_path: Path
) -> None:
    model, trial = add_text_embedder(shelf.store, source(write_embedder(tmp_path / "given")))
    assert trial.same == pytest.approx(1.0)
    assert trial.other == pytest.approx(0.0)
    assert shelf.store.load("tiny").manifest == model.manifest
    assert model.manifest.embedding is not None
    assert model.manifest.embedding.dimensions == len(MEANINGS)
    assert all(one.is_ok for one in verify(shelf, "tiny"))


def test_nothing_is_kept_of_one_that_cannot_be_used(shelf: ModelShelf, tmp_path: Path) -> None:
    dull = write_embedder(tmp_path / "dull", (("bring", "map"), ("fetch", "beverage")))
    with pytest.raises(RunFailed, match="try another --pooling"):
        add_text_embedder(shelf.store, source(dull))
    half = write_embedder(tmp_path / "half")
    (half / "tokenizer.json").unlink()
    with pytest.raises(ModelMismatch, match=r"expected tokenizer.json and one .onnx file"):
        add_text_embedder(shelf.store, source(half))
    with pytest.raises(InferenceError):
        add_text_embedder(shelf.store, source(tmp_path / "nowhere"))
    assert shelf.store.names() == ()


def test_the_memory_is_searched_by_meaning_while_one_is_installed(
    shelf: ModelShelf, tmp_path: Path
) -> None:
    commands = ("fetch the beverage", "clean the couch")
    told = [Episode(told_s=1.0, command=one, outcome=EpisodeOutcome.SUCCEEDED) for one in commands]
    path = tmp_path / "memory.sqlite3"
    with closing(MemoryStore(path, embedder=installed_embedder(shelf))) as store:
        store.add(told)
        assert store.recall("the sofa") == []
    add_text_embedder(shelf.store, source(write_embedder(tmp_path / "given")))
    embedder = installed_embedder(shelf)
    assert embedder is not None
    with closing(MemoryStore(path, embedder=embedder)) as store:
        store.add([])  # what was remembered before gets its vectors along with any writing
        assert [one.episode.command for one in store.recall("the sofa")] == ["clean the couch"]
        assert store.recall("bring a bottle")[0].episode.command == "fetch the beverage"
        assert store.recall("quarterly taxes") == []
        embedder.close()
        assert store.recall("the couch")[0].episode.command == "clean the couch"


def test_a_spoiled_one_is_done_without(shelf: ModelShelf, tmp_path: Path) -> None:
    model, _ = add_text_embedder(shelf.store, source(write_embedder(tmp_path / "given")))
    (model.folder / "model.onnx").write_bytes(b"cut off")
    assert installed_embedder(shelf) is None
    assert [one.is_ok for one in verify(shelf, "tiny")] == [True, False, False]


def test_a_published_one_is_fetched_with_the_tokenizer_of_its_repository(
    tmp_path: Path, open_hub: Callable[..., Any], capsys: pytest.CaptureFixture[str]
) -> None:
    hub = open_hub(write_embedder(tmp_path / "given"), "onnx")
    hub.files["tokenizer.json"] = hub.files.pop("onnx/tokenizer.json")
    hub.files["onnx/model_O1.onnx"] = b"not asked for"
    base = ("--runtime-base", str(tmp_path / "base"), "models")
    given = ("fetch", "minilm-l6", "--endpoint", hub.url, "--profile", "desktop", "--json")
    assert main([*base, *given]) == 0
    assert json.loads(capsys.readouterr().out)["same_meaning_cosine"] == 1.0
    at = f"/{TEXT_EMBEDDERS['minilm-l6'].repository}/resolve/{hub.SHA}/"
    assert {path.removeprefix(at) for path in hub.fetched} == {"onnx/model.onnx", "tokenizer.json"}
    assert main([*base, "verify", "minilm-l6"]) == 0
    assert main([*base, *given]) == 2
    assert "already" in capsys.readouterr().err
