"""Turn sentences into vectors whose cosine says how alike their meanings are.

A text embedder is a transformer's encoder as ONNX, such as sentence-transformers exports it, and
its tokenizer. It is opened and run as every model on board; which one a robot has, its owner
decides by adding one.
"""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from tokenizers import Tokenizer

from platforms import ModelChoice
from vla_deploy.inference.errors import ModelMismatch
from vla_deploy.inference.manifest import Embedding, Pooling
from vla_deploy.inference.manifest_schema import TOKENIZER
from vla_deploy.inference.memory_claims import MemoryClaim
from vla_deploy.inference.opening import GraphSession, open_graph
from vla_deploy.inference.store import StoredModel

Vectors = NDArray[np.float32]

IDS: Final = "input_ids"
MASK: Final = "attention_mask"
TYPES: Final = "token_type_ids"
_KNOWN_INPUTS: Final = frozenset({IDS, MASK, TYPES})
_AT_ONCE: Final = 16
_HASH_DIGITS: Final = 12


class TextEmbedder:
    """Embed texts; may be used from several threads. Texts beyond its tokens are cut off."""

    def __init__(self, name: str, folder: Path, embedding: Embedding, choice: ModelChoice) -> None:
        """Open the files of a folder; `name` says which vectors may be compared.

        Raises:
            ModelMismatch: they do not fit together.
            ModelFileSpoiled: the graph cannot be loaded.
            ProviderUnavailable: no provider that the choice allows runs it.
        """
        self.name = name
        self.least_cosine = embedding.least_cosine
        self.claim = MemoryClaim()
        self._embedding = embedding
        self._tokenizer = _tokenizer(folder, embedding.most_tokens)
        self._graph = open_graph(folder / embedding.graph, choice)
        faults = (*graph_faults(self._graph, embedding),)
        if faults:
            self._graph.close()
            raise ModelMismatch(str(folder), faults)
        self._inputs = [one.name for one in self._graph.inputs]

    def embed(self, texts: Sequence[str]) -> Vectors:
        """Return one row of length 1 per text, or of zeros for an empty one.

        Raises:
            RunFailed: the provider failed, or the session is closed.
        """
        parts = [
            self._embed(texts[begin : begin + _AT_ONCE]) for begin in range(0, len(texts), _AT_ONCE)
        ]
        empty = np.zeros((0, self._embedding.dimensions), dtype=np.float32)
        return np.concatenate([empty, *parts])

    def close(self) -> None:
        """Release the memory; a run after that fails."""
        self._graph.close()
        self.claim.release()

    def _embed(self, texts: Sequence[str]) -> Vectors:
        tokens = [one.ids for one in self._tokenizer.encode_batch(list(texts))]
        width = max(1, *map(len, tokens))
        ids = np.zeros((len(tokens), width), dtype=np.int64)
        mask = np.zeros_like(ids)
        for row, one in enumerate(tokens):
            ids[row, : len(one)] = one
            mask[row, : len(one)] = 1
        given = {IDS: ids, MASK: mask, TYPES: np.zeros_like(ids)}
        output = self._embedding.output
        outputs = self._graph.run([output], {name: given[name] for name in self._inputs})
        rows = _pooled(outputs[output], mask, self._embedding.pooling)
        rows[[not text.strip() for text in texts]] = 0.0
        lengths = np.linalg.norm(rows, axis=1, keepdims=True)
        unit: Vectors = np.divide(rows, lengths, out=rows, where=lengths > 0.0)
        return unit


def open_text_embedder(model: StoredModel, choice: ModelChoice) -> TextEmbedder:
    """Open a model of the store, every file of it as it was checked in.

    Raises:
        ModelMismatch: it is no text embedder, or its files do not fit together.
        ModelFileSpoiled: a file is missing or not what was checked in.
        ProviderUnavailable: no provider that the choice allows runs it.
    """
    embedding = model.manifest.embedding
    if embedding is None:
        raise ModelMismatch(model.manifest.name, ("expected an [embedding] table, there is none",))
    model.check_parts()
    digest = next(one.sha256 for one in model.manifest.parts if one.path == embedding.graph)
    name = f"{model.manifest.name} {digest[:_HASH_DIGITS]}"
    return TextEmbedder(name, model.folder, embedding, choice)


def graph_faults(graph: GraphSession, embedding: Embedding) -> Iterator[str]:
    """Find what a graph lacks to be a text embedder as its manifest says."""
    inputs = {one.name for one in graph.inputs}
    if IDS not in inputs or not inputs <= _KNOWN_INPUTS:
        yield f"{embedding.graph} takes {sorted(inputs)}, expected {IDS}, {MASK} and maybe {TYPES}"
    outputs = {one.name: one for one in graph.outputs}
    found = outputs.get(embedding.output)
    axes = 2 if embedding.pooling is Pooling.NONE else 3
    if found is None:
        yield f"{embedding.graph} gives {sorted(outputs)}, expected {embedding.output!r}"
    elif len(found.shape) != axes or found.shape[-1] != embedding.dimensions:
        yield (
            f"output {embedding.output!r} has the shape {list(found.shape)}, expected {axes} axes, "
            f"the last of {embedding.dimensions}"
        )


def _pooled(values: NDArray[Any], mask: NDArray[np.int64], pooling: Pooling) -> Vectors:
    """Return one row per text of what the encoder gives for each token."""
    rows = values.astype(np.float32)
    if pooling is Pooling.NONE:
        return rows
    if pooling is Pooling.FIRST:
        return np.ascontiguousarray(rows[:, 0])
    weights = mask[:, :, np.newaxis].astype(np.float32)
    mean = (rows * weights).sum(axis=1) / np.maximum(weights.sum(axis=1), 1.0)
    pooled: Vectors = mean.astype(np.float32, copy=False)
    return pooled


def _tokenizer(folder: Path, most_tokens: int) -> Tokenizer:
    try:
        text = (folder / TOKENIZER).read_text(encoding="utf-8")
        tokenizer = Tokenizer.from_str(text)
    # tokenizers raises plain Exception for every fault of a file.
    except Exception as error:
        raise ModelMismatch(str(folder), (f"{TOKENIZER}: {error}",)) from error
    tokenizer.no_padding()
    tokenizer.enable_truncation(most_tokens)
    return tokenizer
