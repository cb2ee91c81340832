"""Only what a trusted key has signed is opened; what is refused leaves nothing behind."""

import base64
import hashlib
import json
import shutil
import subprocess
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from vla_deploy.cli.main import main
from vla_deploy.install import wheels
from vla_deploy.install.errors import ReleaseRefused, SignatureRefused
from vla_deploy.install.minisign import (
    new_key,
    public_key_from,
    public_key_text,
    secret_key_from,
    secret_key_text,
    sign,
    signature_from,
    verify,
)

KEY, OTHER_KEY = new_key(), new_key()
NAME = "vla_deploy-{version}-py3-none-any.whl"
LOCK = "vla_deploy-{version}.data/data/share/vla-deploy/requirements.lock"
TAGS = "Wheel-Version: 1.0\nGenerator: test\nRoot-Is-Purelib: true\nTag: py3-none-any\n"


def tiny_wheel(
    folder: Path, version: str = "1.0", lock: str | None = "", name: str = "vla-deploy"
) -> Path:
    """Write a wheel with one module, and a lock file unless it is None."""
    stem = f"{name.replace('-', '_')}-{version}"
    wheel = folder / f"{stem}-py3-none-any.whl"
    needs = "Requires-Dist: helper\n" if lock else ""
    with zipfile.ZipFile(wheel, "w") as archive:
        archive.writestr(f"{name.replace('-', '_')}/__init__.py", "")
        metadata = f"Metadata-Version: 2.1\nName: {name}\nVersion: {version}\n{needs}"
        archive.writestr(f"{stem}.dist-info/METADATA", metadata)
        archive.writestr(f"{stem}.dist-info/WHEEL", TAGS)
        archive.writestr(f"{stem}.dist-info/RECORD", "")
        if lock is not None:
            archive.writestr(LOCK.format(version=version), lock or "# nothing\n")
    return wheel


def signed(wheel: Path, comment: str = "", key: Any = KEY) -> Path:
    """Write the signature of a wheel next to it."""
    signature = sign(wheel.read_bytes(), key, comment or f"file:{wheel.name}")
    wheel.with_name(f"{wheel.name}.minisig").write_text(signature)
    return wheel


class Computer:
    """Run `vla-deploy release` in a folder that stands for a computer."""

    def __init__(self, root: Path, capsys: pytest.CaptureFixture[str]) -> None:
        self.root = root
        self.keys = root / "etc/vla-deploy/release-keys"
        self.releases = root / "opt/vla-deploy/releases"
        self._capsys = capsys

    def trust(self, text: str) -> None:
        self.keys.mkdir(parents=True, exist_ok=True)
        (self.keys / "release.pub").write_text(text)

    def release(self, *words: object) -> tuple[int, Any, str]:
        code = main(["release", *map(str, words), "--root", str(self.root), "--json"])
        out, err = self._capsys.readouterr()
        return code, json.loads(out) if out else None, err


@pytest.fixture
def computer(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> Computer:
    made = Computer(tmp_path / "root", capsys)
    made.trust(public_key_text(KEY.public))
    return made


def changed(wheel: Path) -> Path:
    data = bytearray(wheel.read_bytes())
    data[-1] ^= 1
    wheel.write_bytes(data)
    return wheel


def comment_changed(wheel: Path) -> Path:
    file = wheel.with_name(f"{wheel.name}.minisig")
    file.write_text(file.read_text().replace("file:", "mine:"))
    return wheel


def bare(text: str) -> Callable[[Path], Path]:
    """Return what puts a text in place of the wheel's signature."""

    def put(wheel: Path) -> Path:
        wheel.with_name(f"{wheel.name}.minisig").write_text(text)
        return wheel

    return put


REFUSED: dict[str, tuple[Callable[[Path], Path], str]] = {
    "no signature": (lambda wheel: wheel, "no signature vla_deploy-1.0"),
    "another key": (lambda wheel: signed(wheel, key=OTHER_KEY), OTHER_KEY.public.key_id),
    "a changed wheel": (lambda wheel: changed(signed(wheel)), "does not fit"),
    "a changed comment": (lambda wheel: comment_changed(signed(wheel)), "does not fit"),
    "another version": (lambda wheel: signed(wheel, "version:2.0"), "signed as version 2.0"),
    "no minisign file": (bare("hello\n"), "expected the four lines"),
    "bad base64": (
        bare("untrusted comment: x\n?\ntrusted comment: y\n?\n"),
        "expected a minisign signature in base64",
    ),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_no_trusted_key_has_signed_is_refused_unopened(
    computer: Computer, tmp_path: Path, case: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    spoil, words = REFUSED[case]
    wheel = spoil(tiny_wheel(tmp_path))
    if case != "another version":
        monkeypatch.setattr(zipfile, "ZipFile", None)  # opening it would raise
    code, _, err = computer.release("add", wheel)
    assert code == 2
    assert words in err
    assert len(err.splitlines()) == 1
    assert not computer.releases.exists()


def test_without_a_key_or_with_one_that_others_may_change_all_is_refused(
    computer: Computer, tmp_path: Path
) -> None:
    wheel = signed(tiny_wheel(tmp_path))
    (computer.keys / "release.pub").chmod(0o666)
    assert "only root may write it" in computer.release("add", wheel)[2]
    (computer.keys / "release.pub").unlink()
    assert "install -D -m 644" in computer.release("add", wheel)[2]
    assert not computer.releases.exists()


def test_a_release_keeps_its_signer_its_packages_come_by_hashes_and_older_ones_are_refused(
    computer: Computer, tmp_path: Path
) -> None:
    house = tmp_path / "wheels"
    house.mkdir()
    helper = tiny_wheel(house, "1.0", lock=None, name="helper")
    good = hashlib.sha256(helper.read_bytes()).hexdigest()
    for version, digest in (("3.0", "0" * 64), ("2.0", good)):
        lock = f"helper==1.0 --hash=sha256:{digest}\n"
        wheel = signed(tiny_wheel(tmp_path, version, lock))
        code, added, err = computer.release("add", wheel, "--wheelhouse", house, "--id", version)
        assert code == (2 if version == "3.0" else 0), err
        assert ("DO NOT MATCH THE HASHES" in err) == (version == "3.0")
    assert [path.name for path in computer.releases.iterdir()] == ["2.0"]
    assert (added["version"], added["signed_by"]) == ("2.0", KEY.public.key_id)
    packages = next(computer.releases.glob("2.0/venv/lib/*/site-packages"))
    assert {"helper", "vla_deploy"} <= {path.name for path in packages.iterdir()}
    assert not list(computer.releases.glob("2.0/*.whl"))

    older = tiny_wheel(tmp_path, "1.9")
    code, _, err = computer.release("add", signed(older))
    assert code == 2
    assert "--allow-downgrade" in err
    code, added, err = computer.release("add", older, "--unsigned", "--allow-downgrade")
    assert (code, added["signed_by"]) == (0, "UNSIGNED")
    assert "UNSIGNED: nobody vouches for" in err
    rows = computer.release("list")[1]
    assert [row["signed_by"] for row in rows] == [KEY.public.key_id, "UNSIGNED"]
    (computer.releases / "2.0/release.json").write_text('{"version": "?"}')
    assert computer.release("list")[1][0]["signed_by"] == "unknown"


def test_a_signed_wheel_without_a_lock_file_is_refused(computer: Computer, tmp_path: Path) -> None:
    err = computer.release("add", signed(tiny_wheel(tmp_path, lock=None)))[2]
    assert "expected share/vla-deploy/requirements.lock" in err
    assert not computer.releases.exists()


def link_entry() -> zipfile.ZipInfo:
    entry = zipfile.ZipInfo("vla_deploy/link")
    entry.external_attr = 0o120777 << 16
    return entry


BAD_ENTRIES: dict[str, tuple[str | zipfile.ZipInfo, bytes]] = {
    "lead out": ("../../etc/passwd", b"x"),
    "that may lead out of it": ("/etc/passwd", b"x"),
    "a path inside": ("a\\..\\b", b"x"),
    "a link or a device": (link_entry(), b"/etc"),
    "ratio of at most": ("bomb", bytes(2 * 1024**2)),
    "each name once": ("vla_deploy/__init__.py", b"x"),
}


@pytest.mark.filterwarnings("ignore:Duplicate name")
@pytest.mark.parametrize("words", BAD_ENTRIES)
def test_a_wheel_beyond_the_bounds_is_not_unpacked(tmp_path: Path, words: str) -> None:
    wheel = tiny_wheel(tmp_path)
    entry, content = BAD_ENTRIES[words]
    with zipfile.ZipFile(wheel, "a", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr(entry, content)
    with pytest.raises(ReleaseRefused, match=words):
        wheels.checked_wheel(wheel, wheel.read_bytes())


@pytest.mark.parametrize("bound", ["MAX_ENTRIES", "MAX_UNPACKED_BYTES", "MAX_WHEEL_BYTES"])
def test_a_wheel_has_a_largest_size(
    tmp_path: Path, bound: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    wheel = tiny_wheel(tmp_path)
    monkeypatch.setattr(wheels, bound, 3)
    with pytest.raises(ReleaseRefused, match="at most 3 "):
        wheels.checked_wheel(wheel, wheels.wheel_bytes(wheel))


def test_a_key_is_made_and_signs_what_it_is_trusted_for(computer: Computer, tmp_path: Path) -> None:
    secret = tmp_path / "release.key"
    assert computer.release("keygen", "--key", secret)[0] == 0
    assert secret.stat().st_mode & 0o777 == 0o600
    assert "is there already" in computer.release("keygen", "--key", secret)[2]
    assert "such as release.key" in computer.release("keygen", "--key", tmp_path / "a.pub")[2]
    wheel = tiny_wheel(tmp_path)
    assert computer.release("sign", wheel, "--key", secret)[0] == 0
    computer.trust((tmp_path / "release.pub").read_text())
    assert computer.release("add", wheel, "--dry-run")[0] == 0


def test_a_key_with_a_password_is_refused(tmp_path: Path) -> None:
    head, data = secret_key_text(KEY).splitlines()
    blob = base64.b64decode(data)
    text = f"{head}\n{base64.b64encode(blob[:2] + b'Sc' + blob[4:]).decode()}\n"
    with pytest.raises(SignatureRefused, match="minisign -S"):
        secret_key_from(text, "release.key")


@pytest.mark.skipif(shutil.which("minisign") is None, reason="minisign is not installed")
def test_minisign_itself_takes_what_we_write_and_we_what_it_writes(tmp_path: Path) -> None:
    def minisign(*words: object) -> None:
        command = ["minisign", *map(str, words)]
        subprocess.run(command, check=True, capture_output=True, cwd=tmp_path)

    file, ours, theirs = (tmp_path / name for name in ("data", "ours.pub", "theirs.pub"))
    file.write_bytes(b"content")
    ours.write_text(public_key_text(KEY.public))
    (tmp_path / "ours.key").write_text(secret_key_text(KEY))
    signature = tmp_path / "data.minisig"
    signature.write_text(sign(b"content", KEY, "file:data\tversion:1.0"))
    minisign("-V", "-H", "-p", ours, "-m", file)
    minisign("-S", "-s", tmp_path / "ours.key", "-m", file)  # takes our secret key
    verify(b"content", signature_from(signature.read_text(), "s"), KEY.public, "data")
    minisign("-G", "-W", "-p", theirs, "-s", tmp_path / "theirs.key")
    minisign("-S", "-s", tmp_path / "theirs.key", "-t", "version:2.0", "-m", file)
    key = public_key_from(theirs.read_text(), "theirs.pub")
    found = signature_from(signature.read_text(), "data.minisig")
    verify(b"content", found, key, "data")
    secret = secret_key_from((tmp_path / "theirs.key").read_text(), "theirs.key")
    assert (secret.public, found.key_id) == (key, key.key_id)
    assert f"minisign public key {key.key_id}" in theirs.read_text()
    minisign("-S", "-l", "-s", tmp_path / "theirs.key", "-m", file)
    with pytest.raises(SignatureRefused, match="prehashed"):
        signature_from(signature.read_text(), "data.minisig")
