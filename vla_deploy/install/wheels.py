"""Look into a wheel, within bounds, before pip does."""

import io
import re
import stat
import zipfile
from dataclasses import dataclass
from email.parser import HeaderParser
from pathlib import Path, PurePosixPath
from typing import Final

from packaging.version import InvalidVersion, Version

from vla_deploy.install.errors import ReleaseRefused

# The wheel of vla-deploy 0.2.0 has 1,722 entries, 49 MB, packed to 38 MB.
MAX_WHEEL_BYTES: Final = 512 * 1024**2
MAX_UNPACKED_BYTES: Final = 1024**3
MAX_ENTRIES: Final = 20_000
MAX_RATIO: Final = 100
_SMALL_BYTES: Final = 1024**2  # below it a high ratio is an empty or regular file, no bomb
_MAX_TEXT_BYTES: Final = 4 * 1024**2
_NAME: Final = re.compile(r"vla_deploy-[A-Za-z0-9.!+_]+(-[A-Za-z0-9_.]+){3,4}\.whl")
_LOCK: Final = re.compile(r"vla_deploy-[^/]+\.data/data/share/vla-deploy/requirements\.lock")
_ENCRYPTED: Final = 0x1


@dataclass(frozen=True, slots=True, kw_only=True)
class CheckedWheel:
    """Hold a wheel of vla-deploy that is within bounds; `lock` is "" where it brings none."""

    name: str
    data: bytes
    version: Version
    lock: str


def wheel_bytes(wheel: Path) -> bytes:
    """Return the content of a file that may be a wheel; nothing of it is interpreted.

    Raises:
        ReleaseRefused: it cannot be read, or is too large.
    """
    try:
        with wheel.open("rb") as file:
            data = file.read(MAX_WHEEL_BYTES + 1)
    except OSError as error:
        raise ReleaseRefused(f"{wheel}: cannot read it: {error.strerror}") from error
    if len(data) > MAX_WHEEL_BYTES:
        raise ReleaseRefused(
            f"{wheel}: expected a wheel of at most {MAX_WHEEL_BYTES} bytes, got more"
        )
    return data


def checked_wheel(wheel: Path, data: bytes) -> CheckedWheel:
    """Return the wheel whose content is `data`.

    Raises:
        ReleaseRefused: it is no wheel of vla-deploy, or beyond the bounds.
    """
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            _refuse_bad_entries(wheel, archive.infolist())
            names = archive.namelist()
            info = [name for name in names if name.endswith(".dist-info/METADATA")]
            if len(info) != 1:
                raise ReleaseRefused(
                    f"{wheel} is no wheel (expected one .dist-info/METADATA, got {len(info)}); "
                    "build one: pip wheel --no-deps ."
                )
            version = _version(wheel, _text(wheel, archive, info[0]))
            locks = [name for name in names if _LOCK.fullmatch(name)]
            lock = _text(wheel, archive, locks[0]) if locks else ""
    except (OSError, ValueError, zipfile.BadZipFile, NotImplementedError) as error:
        raise ReleaseRefused(
            f"{wheel} is no wheel ({error}); build one: pip wheel --no-deps ."
        ) from error
    if not _NAME.fullmatch(wheel.name):
        raise ReleaseRefused(
            f"{wheel}: expected the name of a wheel, vla_deploy-{version}-py3-none-any.whl"
        )
    return CheckedWheel(name=wheel.name, data=data, version=version, lock=lock)


def _version(wheel: Path, metadata: str) -> Version:
    header = HeaderParser().parsestr(metadata)
    if header["Name"] != "vla-deploy":
        raise ReleaseRefused(f"{wheel} is a wheel of {header['Name']}, expected vla-deploy")
    try:
        return Version(str(header["Version"]))
    except InvalidVersion as error:
        raise ReleaseRefused(f"{wheel}: {error}; expected one such as 0.2.0") from error


def _text(wheel: Path, archive: zipfile.ZipFile, name: str) -> str:
    size = archive.getinfo(name).file_size
    if size > _MAX_TEXT_BYTES:
        raise _beyond(wheel, name, f"at most {_MAX_TEXT_BYTES} bytes", f"{size}")
    return archive.read(name).decode()


def _refuse_bad_entries(wheel: Path, entries: list[zipfile.ZipInfo]) -> None:
    """Refuse what could fill the disk or lie outside of the folder that it is unpacked into."""
    if len(entries) > MAX_ENTRIES:
        raise _beyond(wheel, "the wheel", f"at most {MAX_ENTRIES} entries", str(len(entries)))
    unpacked = sum(entry.file_size for entry in entries)
    if unpacked > MAX_UNPACKED_BYTES:
        raise _beyond(
            wheel, "the wheel", f"at most {MAX_UNPACKED_BYTES} bytes unpacked", str(unpacked)
        )
    names = {entry.filename for entry in entries}
    if len(names) < len(entries):
        raise _beyond(wheel, "the wheel", "each name once", "some twice")
    for entry in entries:
        _refuse_bad_entry(wheel, entry)


def _refuse_bad_entry(wheel: Path, entry: zipfile.ZipInfo) -> None:
    name = entry.orig_filename
    path = PurePosixPath(name)
    if path.is_absolute() or ".." in path.parts or "\\" in name or "\0" in name:
        raise _beyond(wheel, repr(name), "a path inside the wheel", "one that may lead out of it")
    kind = stat.S_IFMT(entry.external_attr >> 16)
    if kind not in (0, stat.S_IFREG, stat.S_IFDIR):
        raise _beyond(wheel, repr(name), "a file or a folder", "a link or a device")
    if entry.flag_bits & _ENCRYPTED:
        raise _beyond(wheel, repr(name), "no password", "an encrypted entry")
    ratio = entry.file_size / max(1, entry.compress_size)
    if entry.file_size > _SMALL_BYTES and ratio > MAX_RATIO:
        raise _beyond(wheel, repr(name), f"a ratio of at most {MAX_RATIO}", f"{ratio:.0f}")


def _beyond(wheel: Path, what: str, expected: str, got: str) -> ReleaseRefused:
    return ReleaseRefused(
        f"{wheel}: {what}: expected {expected}, got {got}; it was not unpacked. "
        "Build a wheel anew: pip wheel --no-deps ."
    )
