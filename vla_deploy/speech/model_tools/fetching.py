"""Fetch published Whispers from the Hugging Face hub: only ever when a person asks for it.

The hub tells the hash of each file of the newest commit; every file is fetched at that commit, and
what does not have its hash is refused. Nothing about this robot is sent but the request.
"""

import hashlib
import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final

from vla_deploy.inference.errors import FetchFailed, ModelFileSpoiled, ModelUnknown
from vla_deploy.inference.file_check import sha256_of
from vla_deploy.one_line import one_line
from vla_deploy.speech.errors import SpeechMissing
from vla_deploy.speech.model_tools.adding import PARTS

ENGLISH: Final = ("en",)
TIMEOUT_S: Final = 20.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Published:
    """Name where a model is published, and what it understands."""

    repository: str
    summary: str
    licence: str = "MIT"
    languages: tuple[str, ...] = ENGLISH


def _whisper(size: str, memory: str) -> Published:
    return Published(
        repository=f"Systran/faster-whisper-{size}",
        summary=f"OpenAI's Whisper {size}, converted by SYSTRAN; {memory} of memory in int8",
    )


PUBLISHED: Final[Mapping[str, Published]] = MappingProxyType(
    {
        "whisper-tiny.en": _whisper("tiny.en", "220 MB"),
        "whisper-base.en": _whisper("base.en", "300 MB"),
        "whisper-small.en": _whisper("small.en", "540 MB"),
        "whisper-medium.en": _whisper("medium.en", "1.1 GB"),
        "whisper-tiny": _whisper("tiny", "220 MB"),
        "whisper-base": _whisper("base", "300 MB"),
        "whisper-small": _whisper("small", "540 MB"),
    }
)


def fetch(name: str, folder: Path, endpoint: str | None = None) -> Published:
    """Fetch a model's files into an empty folder, and check them.

    Raises:
        ModelUnknown: no model of that name is known.
        FetchFailed: the hub cannot be reached, or does not have it.
        ModelFileSpoiled: a file is not what the hub says it is.
        SpeechMissing: faster-whisper, which brings the hub's client, is not installed.
    """
    published = PUBLISHED.get(name)
    if published is None:
        raise ModelUnknown(f"no model {name!r} to fetch: expected one of {', '.join(PUBLISHED)}")
    hub = _hub()
    with _told(hub, published.repository):
        api = hub.HfApi(endpoint=endpoint, token=False)
        info = api.model_info(published.repository, files_metadata=True, timeout=TIMEOUT_S)
    files = [one for one in info.siblings or () if one.rfilename in PARTS]
    for file in files:
        with _told(hub, published.repository):
            hub.hf_hub_download(
                published.repository,
                file.rfilename,
                revision=info.sha,
                local_dir=folder,
                endpoint=endpoint,
                token=False,
            )
        _check(folder / file.rfilename, file)
    return published


def _check(path: Path, file: Any) -> None:
    """Compare a file with what the hub says of it: SHA-256 of large ones, git's hash of small ones.

    Raises:
        ModelFileSpoiled: it is another one.
    """
    if file.lfs is not None:
        expected, got = str(file.lfs.sha256), sha256_of(path)
    else:
        content = path.read_bytes()
        blob = b"blob %d\0" % len(content) + content
        expected, got = str(file.blob_id), hashlib.sha1(blob, usedforsecurity=False).hexdigest()
    if expected != got:
        raise ModelFileSpoiled(f"{path.name}: expected the hash {expected}, got {got}; try again")


@contextmanager
def _told(hub: Any, repository: str) -> Iterator[None]:
    """Turn what the hub's client raises into one line.

    Raises:
        FetchFailed: the hub was not reached, or does not have it.
    """
    try:
        yield
    except (hub.errors.HTTPError, OSError, ValueError) as error:
        raise FetchFailed(
            f"{repository}: the hub was not reached or does not have it: {one_line(error)[:300]}; "
            "this computer needs a way to huggingface.co for this once; or copy the files here by "
            "hand, then: vla-deploy models add NAME --whisper FOLDER"
        ) from error


def _hub() -> Any:
    os.environ["HF_HUB_DISABLE_TELEMETRY"] = "1"
    os.environ["HF_HUB_DISABLE_PROGRESS_BARS"] = "1"
    try:
        return import_module("huggingface_hub")
    except ImportError as error:
        raise SpeechMissing(
            "fetching needs the hub's client: pip install 'vla-deploy[speech]'"
        ) from error
