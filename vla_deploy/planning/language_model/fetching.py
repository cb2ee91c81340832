"""Fetch published language models in the form of onnxruntime-genai from the Hugging Face hub."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from types import MappingProxyType
from typing import Final

from vla_deploy.inference.errors import FetchFailed, ModelUnknown
from vla_deploy.inference.hub import HubCommit, HubPlace
from vla_deploy.inference.language_schema import GENAI_CONFIG
from vla_deploy.planning.language_model.adding import is_part

_BY_HAND: Final = "vla-deploy models add NAME --language FOLDER"
_MIT: Final = "MIT"
_LLAMA: Final = "Llama 3.2 Community License"
_CPU: Final = "cpu_and_mobile/cpu-int4-rtn-block-32-acc-level-4"


@dataclass(frozen=True, slots=True, kw_only=True)
class PublishedLanguageModel:
    """Name the folder of a repository that a model is published in.

    `licence` is "" where only the repository says; `size_gb` is about that of its files, 0 where
    nobody has looked.
    """

    repository: str
    folder: str = ""
    revision: str = "main"
    summary: str = "a published language model"
    licence: str = ""
    size_gb: float = 0.0

    def __str__(self) -> str:
        """Return it as `models fetch --language` takes it."""
        return f"{self.repository}:{self.folder}" if self.folder else self.repository

    @classmethod
    def named(cls, place: str) -> "PublishedLanguageModel":
        """Read OWNER/REPO[:FOLDER].

        Raises:
            ModelUnknown: it is no such text.
        """
        repository, _, folder = place.partition(":")
        parts = (*repository.split("/"), *PurePosixPath(folder).parts)
        if repository.count("/") != 1 or not all(parts) or ".." in parts or folder[:1] == "/":
            raise ModelUnknown(f"expected OWNER/REPO or OWNER/REPO:FOLDER, got {place!r}")
        return cls(repository=repository, folder=folder.strip("/"))


PUBLISHED: Final[Mapping[str, PublishedLanguageModel]] = MappingProxyType(
    {
        "qwen2.5-0.5b-cpu": PublishedLanguageModel(
            repository="amd/Qwen2.5-0.5B-Instruct-quantized_int4-float16-cpu-onnx",
            summary="Alibaba's Qwen2.5 0.5B Instruct, int4, converted by AMD",
            licence="Apache-2.0 (Qwen2.5's; the repository states none)",
            size_gb=0.8,
        ),
        "llama-3.2-1b-cpu": PublishedLanguageModel(
            repository="onnx-community/Llama-3.2-1B-Instruct-ONNX",
            folder=_CPU,
            summary="Meta's Llama 3.2 1B Instruct, int4 for the CPU",
            licence=_LLAMA,
            size_gb=1.8,
        ),
        "llama-3.2-1b-gpu": PublishedLanguageModel(
            repository="onnx-community/Llama-3.2-1B-Instruct-ONNX",
            folder="cuda/cuda-int4-rtn-block-32",
            summary="Meta's Llama 3.2 1B Instruct, int4 and fp16 for CUDA",
            licence=_LLAMA,
            size_gb=1.2,
        ),
        "llama-3.2-3b-gpu": PublishedLanguageModel(
            repository="onnx-community/Llama-3.2-3B-Instruct-ONNX",
            folder="cuda/cuda-int4-rtn-block-32",
            summary="Meta's Llama 3.2 3B Instruct, int4 and fp16 for CUDA",
            licence=_LLAMA,
            size_gb=2.6,
        ),
        "phi-3.5-mini-cpu": PublishedLanguageModel(
            repository="microsoft/Phi-3.5-mini-instruct-onnx",
            folder="cpu_and_mobile/cpu-int4-awq-block-128-acc-level-4",
            summary="Microsoft's Phi-3.5 mini instruct (3.8B), int4 for the CPU",
            licence=_MIT,
            size_gb=2.8,
        ),
        "phi-4-mini-cpu": PublishedLanguageModel(
            repository="microsoft/Phi-4-mini-instruct-onnx",
            folder=_CPU,
            summary="Microsoft's Phi-4 mini instruct (3.8B), int4 for the CPU",
            licence=_MIT,
            size_gb=4.9,
        ),
        "phi-4-mini-gpu": PublishedLanguageModel(
            repository="microsoft/Phi-4-mini-instruct-onnx",
            folder="gpu/gpu-int4-rtn-block-32",
            summary="Microsoft's Phi-4 mini instruct (3.8B), int4 and fp16 for GPUs",
            licence=_MIT,
            size_gb=3.4,
        ),
    }
)
"""Where models in this form are published; the hub alone knows their hashes."""


def fetch(
    published: PublishedLanguageModel,
    folder: Path,
    tell: Callable[[str], None],
    endpoint: str | None = None,
) -> tuple[Path, str]:
    """Fetch a model's files into an empty folder, and check them.

    Returns the folder that they lie in, and the licence as the table or the hub states it.

    Raises:
        FetchFailed: the hub cannot be reached, or has no such model there, or the disk is full.
        ModelFileSpoiled: a file is not what the hub says it is.
        ToolMissing: the hub's client is not installed.
    """
    commit = HubCommit(
        HubPlace(
            repository=published.repository,
            by_hand=_BY_HAND,
            revision=published.revision,
            endpoint=endpoint,
        )
    )
    folder_there = PurePosixPath(published.folder)
    files = [PurePosixPath(path) for path in commit.paths]
    wanted = [str(file) for file in files if file.parent == folder_there and is_part(file.name)]
    if GENAI_CONFIG not in {PurePosixPath(path).name for path in wanted}:
        models = ", ".join(str(file.parent) for file in files if file.name == GENAI_CONFIG)
        raise FetchFailed(
            f"{published}: no {GENAI_CONFIG} lies there; expected the layout of "
            f"onnxruntime-genai, which is in: {models or 'no folder of it'}"
        )
    commit.fetch(wanted, folder, tell)
    return folder / published.folder, published.licence or commit.licence or "not stated"
