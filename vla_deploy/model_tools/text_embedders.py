"""Add a person's text embedder, and say how alike it finds sentences."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from platforms import ModelChoice
from vla_deploy.inference.errors import ModelFileSpoiled, ModelMismatch, RunFailed
from vla_deploy.inference.manifest import Embedding, Manifest, Pooling, Tensor
from vla_deploy.inference.manifest_schema import TEXT_EMBEDDER, TOKENIZER
from vla_deploy.inference.opening import PLAIN_CHOICE, open_graph
from vla_deploy.inference.store import ModelStore, StoredModel
from vla_deploy.inference.text_embedder import open_text_embedder
from vla_deploy.model_tools.keeping import FolderSource, keep_folder, require_free

# Sentences of one meaning in other words, and one of another meaning.
TRIAL: Final = (
    "bring me something to drink",
    "fetch a beverage for me",
    "the map of the flat is out of date",
)
GRAPH: Final = "model.onnx"
"""What exports call it."""
LEAST_COSINE: Final = 0.3
MOST_TOKENS: Final = 512
"""As many as BERT's positions; a longer text is cut off."""
_WHOLE: Final = "sentence_embedding"
_WEIGHTS: Final = (".onnx", ".onnx.data", ".onnx_data")


@dataclass(frozen=True, slots=True, kw_only=True)
class TextEmbedderSource(FolderSource):
    """Hold what a person says of a text embedder."""

    pooling: Pooling
    most_tokens: int
    least_cosine: float


@dataclass(frozen=True, slots=True, kw_only=True)
class LikenessTrial:
    """Hold the cosines of the trial: of one meaning in other words, and of two meanings."""

    same: float
    other: float


def add_text_embedder(
    store: ModelStore,
    source: TextEmbedderSource,
    *,
    replace: bool = False,
    choice: ModelChoice = PLAIN_CHOICE,
) -> tuple[StoredModel, LikenessTrial]:
    """Check a text embedder, try it out, keep it; when anything is wrong, nothing changes.

    Raises:
        ModelUnknown: the name cannot be used, or is taken and `replace` is not set.
        ModelMismatch: files are missing, or do not fit together.
        RunFailed: it finds what means the same less alike than what does not.
        InferenceError: it does not run; each kind says why.
        OSError: the model cannot be stored.
    """
    require_free(store, source.name, replace=replace)
    return keep_folder(store, source, describe(source), lambda model: try_out(model, choice))


def describe(source: TextEmbedderSource) -> Manifest:
    """Return the manifest for a folder of files.

    Raises:
        ModelMismatch: the tokenizer or the only graph is missing, or gives nothing that fits.
        ModelFileSpoiled: a file cannot be read.
    """
    names = sorted(path.name for path in _files(source.folder))
    graphs = [name for name in names if name.endswith(".onnx")]
    if TOKENIZER not in names or len(graphs) != 1:
        fault = f"expected {TOKENIZER} and one .onnx file, found {', '.join(names) or 'nothing'}"
        raise ModelMismatch(str(source.folder), (fault,))
    output = _output(source.folder / graphs[0])
    embedding = Embedding(
        graph=graphs[0],
        output=output.name,
        pooling=Pooling.NONE if output.name == _WHOLE else source.pooling,
        dimensions=int(output.shape[-1]),
        most_tokens=source.most_tokens,
        least_cosine=source.least_cosine,
    )
    parts = [name for name in names if name == TOKENIZER or name.endswith(_WEIGHTS)]
    return source.manifest(TEXT_EMBEDDER, parts, embedding=embedding)


def try_out(model: StoredModel, choice: ModelChoice = PLAIN_CHOICE) -> LikenessTrial:
    """Return how alike a model finds three sentences.

    Raises:
        RunFailed: it finds what means the same less alike than what does not.
        InferenceError: it does not run; each kind says why.
    """
    embedder = open_text_embedder(model, choice)
    try:
        first, same, other = embedder.embed(TRIAL)
    finally:
        embedder.close()
    trial = LikenessTrial(same=float(first @ same), other=float(first @ other))
    if trial.same <= trial.other:
        raise RunFailed(
            f"{model.manifest.name}: the cosine of {TRIAL[0]!r} and {TRIAL[1]!r} is "
            f"{trial.same:.2f}, that with {TRIAL[2]!r} {trial.other:.2f}; expected the first to be "
            "higher: try another --pooling, or another export"
        )
    return trial


def _output(graph: Path) -> Tensor:
    """Return the output to read: the embedding of the whole text, else that of its tokens."""
    session = open_graph(graph)
    try:
        outputs: Sequence[Tensor] = session.outputs
    finally:
        session.close()
    fits = [one for one in outputs if isinstance(one.shape[-1], int) and len(one.shape) in (2, 3)]
    whole = [one for one in fits if one.name == _WHOLE]
    tokens = [one for one in fits if len(one.shape) == 3]
    if not whole and not tokens:
        shapes = {one.name: list(one.shape) for one in outputs}
        fault = f"{graph.name} gives {shapes}, expected a vector for each token or for the text"
        raise ModelMismatch(str(graph.parent), (fault,))
    return (whole or tokens)[0]


def _files(folder: Path) -> list[Path]:
    try:
        return [path for path in folder.iterdir() if path.is_file()]
    except OSError as error:
        raise ModelFileSpoiled(f"{folder}: {error.strerror or error}") from error
