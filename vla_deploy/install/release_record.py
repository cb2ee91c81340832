"""Keep with each release what it was made of, and who vouches for it."""

import json
from dataclasses import asdict, dataclass
from enum import StrEnum
from pathlib import Path
from typing import Final

from packaging.version import Version

from vla_deploy.install.disk import write_file

RECORD_NAME: Final = "release.json"
UNSIGNED: Final = "UNSIGNED"
_UNKNOWN: Final = "unknown"


class PackagesFrom(StrEnum):
    """Name by what the packages that a release needs were chosen."""

    HASHES = "hashes of the wheel's lock file"
    NAMES = "names and versions, no hashes"
    SHARED = "shared folder, not examined"


@dataclass(frozen=True, slots=True, kw_only=True)
class ReleaseRecord:
    """Hold a release's version, the wheel's SHA-256, its signer, and how packages were chosen.

    `signed_by` is the id of the key, "UNSIGNED", or "unknown" for a release older than records.
    """

    version: str = ""
    sha256: str = ""
    signed_by: str = _UNKNOWN
    trusted_comment: str = ""
    packages: str = _UNKNOWN

    def write(self, folder: Path) -> None:
        """Write it into the folder of the release."""
        text = json.dumps(asdict(self), indent=1)
        write_file(folder / RECORD_NAME, f"{text}\n", 0o644)


def record_of(folder: Path) -> ReleaseRecord:
    """Return the record of a release; of one that has none, or a damaged one, little is known."""
    try:
        record = ReleaseRecord(**json.loads((folder / RECORD_NAME).read_text()))
        Version(record.version)
    except (OSError, ValueError, TypeError):
        return ReleaseRecord()
    return record


def newest(records: dict[str, ReleaseRecord]) -> tuple[str, Version] | None:
    """Return the id and the version of the newest release, None where no version is known."""
    known = [(Version(record.version), name) for name, record in records.items() if record.version]
    if not known:
        return None
    version, name = max(known)
    return name, version
