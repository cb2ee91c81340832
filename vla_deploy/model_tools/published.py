"""Fetch published Whispers and language models from the Hugging Face hub."""

import tempfile
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from types import MappingProxyType
from typing import Final

from vla_deploy.inference.errors import FetchFailed, ModelUnknown
from vla_deploy.inference.manifest_schema import GENAI_CONFIG, TOKENIZER, WHISPER_PARTS
from vla_deploy.inference.store import ModelStore
from vla_deploy.model_tools.hub import HubCommit
from vla_deploy.model_tools.language_models import is_part
from vla_deploy.model_tools.text_embedders import GRAPH
from vla_deploy.model_tools.whispers import PARTS

_MIT: Final = "MIT"
_LLAMA: Final = "Llama 3.2 Community License"
_CPU: Final = "cpu_and_mobile/cpu-int4-rtn-block-32-acc-level-4"


@dataclass(frozen=True, slots=True, kw_only=True)
class ModelFormat:
    """Say which files make up a model of a kind; where one lies, there is its `landmark`.

    `option` is that of `models add` for a folder of this form. Files `at_root` lie at the root of
    many repositories instead of in the model's folder.
    """

    name: str
    option: str
    landmark: str
    is_part: Callable[[str], bool]
    at_root: tuple[str, ...] = ()


WHISPER: Final = ModelFormat(
    name="CTranslate2",
    option="--whisper",
    landmark=WHISPER_PARTS[0],
    is_part=PARTS.__contains__,
)
LANGUAGE: Final = ModelFormat(
    name="onnxruntime-genai", option="--language", landmark=GENAI_CONFIG, is_part=is_part
)

EMBEDDER: Final = ModelFormat(
    name="sentence-transformers' ONNX export",
    option="--embedder",
    landmark=GRAPH,
    is_part=(GRAPH, f"{GRAPH}_data", TOKENIZER).__contains__,
    at_root=(TOKENIZER,),
)


@dataclass(frozen=True, slots=True, kw_only=True)
class PublishedModel:
    """Name the folder of a repository that a model is published in.

    `licence` is "" where only the repository says.
    """

    repository: str
    folder: str = ""
    revision: str = "main"
    summary: str = "a published language model"
    licence: str = ""
    format: ModelFormat = LANGUAGE

    def __str__(self) -> str:
        """Return it as `models fetch --language` takes it."""
        return f"{self.repository}:{self.folder}" if self.folder else self.repository

    @classmethod
    def named(cls, place: str) -> "PublishedModel":
        """Read OWNER/REPO[:FOLDER].

        Raises:
            ModelUnknown: it is no such text.
        """
        repository, _, folder = place.partition(":")
        parts = (*repository.split("/"), *PurePosixPath(folder).parts)
        if repository.count("/") != 1 or not all(parts) or ".." in parts or folder[:1] == "/":
            raise ModelUnknown(f"expected OWNER/REPO or OWNER/REPO:FOLDER, got {place!r}")
        return cls(repository=repository, folder=folder.strip("/"))


WHISPERS: Final[Mapping[str, PublishedModel]] = MappingProxyType(
    {
        name: PublishedModel(
            repository=f"Systran/faster-{name}",
            summary=f"OpenAI's {name}, converted by SYSTRAN; {memory} of memory in int8",
            licence=_MIT,
            format=WHISPER,
        )
        for name, memory in (
            ("whisper-tiny.en", "220 MB"),
            ("whisper-base.en", "300 MB"),
            ("whisper-small.en", "540 MB"),
            ("whisper-medium.en", "1.1 GB"),
            ("whisper-tiny", "220 MB"),
            ("whisper-base", "300 MB"),
            ("whisper-small", "540 MB"),
        )
    }
)
LANGUAGE_MODELS: Final[Mapping[str, PublishedModel]] = MappingProxyType(
    {
        "qwen2.5-0.5b-cpu": PublishedModel(
            repository="amd/Qwen2.5-0.5B-Instruct-quantized_int4-float16-cpu-onnx",
            summary="Alibaba's Qwen2.5 0.5B Instruct, int4, converted by AMD",
            licence="Apache-2.0 (Qwen2.5's; the repository states none)",
        ),
        "llama-3.2-1b-cpu": PublishedModel(
            repository="onnx-community/Llama-3.2-1B-Instruct-ONNX",
            folder=_CPU,
            summary="Meta's Llama 3.2 1B Instruct, int4 for the CPU",
            licence=_LLAMA,
        ),
        "llama-3.2-1b-gpu": PublishedModel(
            repository="onnx-community/Llama-3.2-1B-Instruct-ONNX",
            folder="cuda/cuda-int4-rtn-block-32",
            summary="Meta's Llama 3.2 1B Instruct, int4 and fp16 for CUDA",
            licence=_LLAMA,
        ),
        "llama-3.2-3b-gpu": PublishedModel(
            repository="onnx-community/Llama-3.2-3B-Instruct-ONNX",
            folder="cuda/cuda-int4-rtn-block-32",
            summary="Meta's Llama 3.2 3B Instruct, int4 and fp16 for CUDA",
            licence=_LLAMA,
        ),
        "phi-3.5-mini-cpu": PublishedModel(
            repository="microsoft/Phi-3.5-mini-instruct-onnx",
            folder="cpu_and_mobile/cpu-int4-awq-block-128-acc-level-4",
            summary="Microsoft's Phi-3.5 mini instruct (3.8B), int4 for the CPU",
            licence=_MIT,
        ),
        "phi-4-mini-cpu": PublishedModel(
            repository="microsoft/Phi-4-mini-instruct-onnx",
            folder=_CPU,
            summary="Microsoft's Phi-4 mini instruct (3.8B), int4 for the CPU",
            licence=_MIT,
        ),
        "phi-4-mini-gpu": PublishedModel(
            repository="microsoft/Phi-4-mini-instruct-onnx",
            folder="gpu/gpu-int4-rtn-block-32",
            summary="Microsoft's Phi-4 mini instruct (3.8B), int4 and fp16 for GPUs",
            licence=_MIT,
        ),
    }
)
TEXT_EMBEDDERS: Final[Mapping[str, PublishedModel]] = MappingProxyType(
    {
        "minilm-l6": PublishedModel(
            repository="sentence-transformers/all-MiniLM-L6-v2",
            folder="onnx",
            summary="all-MiniLM-L6-v2 of sentence-transformers, fp32, 90 MB, English",
            licence="Apache-2.0",
            format=EMBEDDER,
        )
    }
)
"""Where models are published; the hub alone knows their hashes."""


@contextmanager
def fetched(
    published: PublishedModel,
    store: ModelStore,
    report: Callable[[str], None],
    endpoint: str | None = None,
) -> Iterator[tuple[Path, str]]:
    """Fetch a model's files for a `with` block, and check them; `report` gets a line for each.

    Yields the folder that they lie in, and the licence as the table or the hub states it. The
    folder goes afterwards; it is next to the added models, as one in memory has no room for
    gigabytes.

    Raises:
        FetchFailed: the hub cannot be reached, or has no such model there, or the disk is full.
        ModelFileSpoiled: a file is not what the hub says it is.
        PackageMissing: the hub's client is not installed.
    """
    form = published.format
    commit = HubCommit(
        published.repository,
        revision=published.revision,
        endpoint=endpoint,
        by_hand=f"vla-deploy models add NAME {form.option} FOLDER",
    )
    there = PurePosixPath(published.folder)
    files = [PurePosixPath(path) for path in commit.paths]
    wanted = [str(file) for file in files if file.parent == there and form.is_part(file.name)]
    apart = [name for name in form.at_root if str(there / name) not in wanted]
    apart = [name for name in apart if name in commit.paths]
    if str(there / form.landmark) not in wanted:
        models = ", ".join(str(file.parent) for file in files if file.name == form.landmark)
        raise FetchFailed(
            f"{published}: no {form.landmark} lies there; expected the layout of {form.name}, "
            f"which is in: {models or 'no folder of it'}"
        )
    store.user.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix=".fetch-", dir=store.user) as directory:
        folder = Path(directory)
        commit.fetch([*wanted, *apart], folder, report)
        for name in apart:
            (folder / name).replace(folder / published.folder / name)
        yield folder / published.folder, published.licence or commit.licence or "not stated"
