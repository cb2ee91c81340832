"""Fetch files of a published model from the Hugging Face hub: only ever when a person asks for it.

The hub states the commit, and the hash of each file in it; every file is fetched at that commit,
and one that does not have its hash is refused. Nothing about this robot is sent but the request.
"""

import hashlib
import os
import shutil
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path
from typing import Any, Final

from vla_deploy.inference.errors import FetchFailed, ModelFileSpoiled, PackageMissing
from vla_deploy.inference.store import sha256_of
from vla_deploy.runtime.one_line import one_line

TIMEOUT_S: Final = 20.0
_BYTES_PER_GB: Final = 1e9
# What is fetched is tried out as a copy before it is kept.
_COPIES: Final = 2


class HubCommit:
    """Hold what the hub says of one commit of a repository, and fetch files of it."""

    def __init__(
        self, repository: str, *, revision: str, endpoint: str | None, by_hand: str
    ) -> None:
        """Ask the hub, or the server at `endpoint`, for a branch, tag or commit of a repository.

        `by_hand` is the command that adds the files without the hub.

        Raises:
            FetchFailed: it cannot be reached, or does not have the repository.
            PackageMissing: its client is not installed.
        """
        self._repository = repository
        self._endpoint = endpoint
        self._by_hand = by_hand
        self._hub = _client()
        with self._translated():
            self._info = self._hub.HfApi(endpoint=endpoint, token=False).model_info(
                repository,
                revision=revision,
                files_metadata=True,
                timeout=TIMEOUT_S,
            )
        self._files = {one.rfilename: one for one in self._info.siblings or ()}

    @property
    def paths(self) -> tuple[str, ...]:
        """Return the path of each file in the repository."""
        return tuple(self._files)

    @property
    def licence(self) -> str:
        """Return the licence that the repository states, "" where it states none."""
        card = self._info.card_data
        return str(card.get("license") or "") if card is not None else ""

    def fetch(self, paths: Sequence[str], folder: Path, report: Callable[[str], None]) -> None:
        """Fetch files into a folder, at their paths, and check them; `report` gets a line for each.

        Raises:
            FetchFailed: one does not come, or the disk has no room for them.
            ModelFileSpoiled: one is not what the hub says it is.
        """
        self._check_room(sum(self._files[path].size or 0 for path in paths), folder)
        for path in paths:
            file = self._files[path]
            report(f"fetching {path}, {(file.size or 0) / _BYTES_PER_GB:.3f} GB")
            with self._translated():
                self._hub.hf_hub_download(
                    self._repository,
                    path,
                    revision=self._info.sha,
                    local_dir=folder,
                    endpoint=self._endpoint,
                    token=False,
                )
            _check(folder / path, file)

    def _check_room(self, size_bytes: int, folder: Path) -> None:
        needed_bytes, free_bytes = _COPIES * size_bytes, shutil.disk_usage(folder).free
        if needed_bytes > free_bytes:
            raise FetchFailed(
                f"{self._repository}: its files need {needed_bytes / _BYTES_PER_GB:.1f} GB "
                f"of {folder} while they are tried out, {free_bytes / _BYTES_PER_GB:.1f} GB are "
                "free; make room, or choose a smaller model"
            )

    @contextmanager
    def _translated(self) -> Iterator[None]:
        try:
            yield
        except (self._hub.errors.HTTPError, OSError, ValueError) as error:
            raise FetchFailed(
                f"{self._repository}: the hub was not reached or does not have it: "
                f"{one_line(error)[:300]}; this computer needs a way to huggingface.co for this "
                f"once; or copy the files here by hand, then: {self._by_hand}"
            ) from error


def _client() -> Any:
    os.environ["HF_HUB_DISABLE_TELEMETRY"] = "1"
    os.environ["HF_HUB_DISABLE_PROGRESS_BARS"] = "1"
    try:
        return import_module("huggingface_hub")
    except ImportError as error:
        raise PackageMissing(
            "fetching needs the hub's client: pip install 'vla-deploy[speech]'"
        ) from error


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
