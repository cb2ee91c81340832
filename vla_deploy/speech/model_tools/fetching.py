"""Fetch published Whispers from the Hugging Face hub: only ever when a person asks for it.

The hub tells the hash of each file of the newest commit; every file is fetched at that commit, and
what does not have its hash is refused. Nothing about this robot is sent but the request.
"""

import hashlib
import os
from collections.abc import Iterator, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final

from vla_deploy.inference.errors import FetchFailed, ModelFileSpoiled, ModelUnknown
from vla_deploy.inference.file_check import sha256_of
from vla_deploy.one_line import one_line
from vla_deploy.speech.errors import import_extra
from vla_deploy.speech.model_tools.adding import PARTS

TIMEOUT_S: Final = 20.0
LICENCE: Final = "MIT"
PUBLISHED: Final[Mapping[str, str]] = MappingProxyType(
    {
        "whisper-tiny.en": "220 MB",
        "whisper-base.en": "300 MB",
        "whisper-small.en": "540 MB",
        "whisper-medium.en": "1.1 GB",
        "whisper-tiny": "220 MB",
        "whisper-base": "300 MB",
        "whisper-small": "540 MB",
    }
)
"""OpenAI's Whispers as SYSTRAN converted them, and the memory that each takes in int8."""


def summary_of(name: str) -> str:
    """Return what a published model is, for people."""
    return f"OpenAI's {name}, converted by SYSTRAN; {PUBLISHED[name]} of memory in int8"


def fetch(name: str, folder: Path, endpoint: str | None = None) -> None:
    """Fetch a model's files into an empty folder, and check them.

    Raises:
        ModelUnknown: no model of that name is known.
        FetchFailed: the hub cannot be reached, or does not have it.
        ModelFileSpoiled: a file is not what the hub says it is.
        SpeechMissing: faster-whisper, which brings the hub's client, is not installed.
    """
    if name not in PUBLISHED:
        raise ModelUnknown(f"no model {name!r} to fetch: expected one of {', '.join(PUBLISHED)}")
    os.environ["HF_HUB_DISABLE_TELEMETRY"] = "1"
    os.environ["HF_HUB_DISABLE_PROGRESS_BARS"] = "1"
    hub = import_extra("huggingface_hub", "fetching needs the hub's client")
    repository = f"Systran/faster-{name}"
    try:
        files = list(_downloaded(hub, repository, folder, endpoint))
    except (hub.errors.HTTPError, OSError, ValueError) as error:
        raise FetchFailed(
            f"{repository}: the hub was not reached or does not have it: {one_line(error)[:300]}; "
            "this computer needs a way to huggingface.co for this once; or copy the files here by "
            "hand, then: vla-deploy models add NAME --whisper FOLDER"
        ) from error
    for file in files:
        _check(folder / file.rfilename, file)


def _downloaded(hub: Any, repository: str, folder: Path, endpoint: str | None) -> Iterator[Any]:
    """Fetch each file of the newest commit, and yield what the hub says of it."""
    api = hub.HfApi(endpoint=endpoint, token=False)
    info = api.model_info(repository, files_metadata=True, timeout=TIMEOUT_S)
    at = {"revision": info.sha, "local_dir": folder, "endpoint": endpoint, "token": False}
    for file in info.siblings or ():
        if file.rfilename in PARTS:
            hub.hf_hub_download(repository, file.rfilename, **at)
            yield file


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
