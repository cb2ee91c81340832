"""Keep the public keys whose releases this computer takes, and find who signed a wheel.

The folder and the files belong to root, so that whoever may replace them may do anything anyway.
"""

import os
import stat
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from vla_deploy.install.errors import SignatureRefused
from vla_deploy.install.minisign import (
    FileSignature,
    SigningPublicKey,
    public_key_from,
    signature_from,
    verify,
)

RELEASE_KEYS: Final = Path("/etc/vla-deploy/release-keys")
SIGNATURE_SUFFIX: Final = ".minisig"
VERSION_FIELD: Final = "version:"
_UNSIGNED: Final = "to add it all the same, as a developer: --unsigned"
_MAX_TEXT_BYTES: Final = 4096


@dataclass(frozen=True, slots=True, kw_only=True)
class ReleaseSignature:
    """Say by which key a release was signed, and what the signer said of it."""

    key_id: str
    trusted_comment: str

    @property
    def version(self) -> str:
        """Return the version that the signer has named, "" where none."""
        fields = self.trusted_comment.split("\t")
        named = [field for field in fields if field.startswith(VERSION_FIELD)]
        return named[0].removeprefix(VERSION_FIELD) if named else ""


def signature_of(wheel: Path, data: bytes, folder: Path) -> ReleaseSignature:
    """Return who signed a wheel, by the keys in `folder`; nothing of the wheel is interpreted.

    Raises:
        SignatureRefused: there is no key, no signature, or none by a trusted key.
    """
    keys = trusted_keys(folder)
    signature = _signature(wheel)
    key = keys.get(signature.key_id)
    if key is None:
        listed = ", ".join(sorted(keys))
        raise SignatureRefused(
            f"{wheel}: signed by key {signature.key_id}, expected one of {listed} ({folder}); "
            f"if you trust that key, put its file there; {_UNSIGNED}"
        )
    verify(data, signature, key, str(wheel))
    return ReleaseSignature(key_id=key.key_id, trusted_comment=signature.trusted_comment)


def trusted_keys(folder: Path) -> dict[str, SigningPublicKey]:
    """Return the trusted keys by their ids.

    Raises:
        SignatureRefused: there is none, one is damaged, or somebody else may change them.
    """
    files = sorted(folder.glob("*.pub"))
    if not files:
        raise SignatureRefused(
            f"no release key in {folder}; put one there: "
            f"sudo install -D -m 644 release.pub {folder}/release.pub; {_UNSIGNED}"
        )
    for path in (folder, *files):
        _require_ours(path)
    keys = [public_key_from(_text(path), str(path)) for path in files]
    return {key.key_id: key for key in keys}


def _signature(wheel: Path) -> FileSignature:
    path = wheel.with_name(wheel.name + SIGNATURE_SUFFIX)
    if not path.is_file():
        raise SignatureRefused(
            f"{wheel}: no signature {path.name} next to it; get it from where the wheel was "
            f"published, or sign: vla-deploy release sign {wheel} --key FILE; {_UNSIGNED}"
        )
    return signature_from(_text(path), str(path))


def _text(path: Path) -> str:
    with path.open("rb") as file:
        return file.read(_MAX_TEXT_BYTES).decode(errors="replace")


def _require_ours(path: Path) -> None:
    found = path.stat()
    if found.st_uid not in (0, os.geteuid()) or found.st_mode & (stat.S_IWGRP | stat.S_IWOTH):
        raise SignatureRefused(
            f"{path}: expected that only root may write it, got user {found.st_uid}, mode "
            f"{stat.S_IMODE(found.st_mode):o}: sudo chown root:root {path}; sudo chmod go-w {path}"
        )
