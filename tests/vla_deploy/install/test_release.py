"""A release is built from a wheel beside the others; it is there whole or not at all."""

import json
import os
import signal
import subprocess
import sys
import time
import zipfile
from pathlib import Path

import pytest
from packaging.version import Version

from vla_deploy.cli.main import main
from vla_deploy.install.building import ReleaseSource, add_release, examined
from vla_deploy.install.errors import InstallError, ReleaseRefused
from vla_deploy.install.releases import ReleaseStore
from vla_deploy.install.wheels import CheckedWheel

ROOT = Path(__file__).parents[3]
PACKAGES = next(path for path in sys.path if path.endswith("site-packages"))
UNSIGNED = ("--unsigned", "--share-packages", PACKAGES)
SUFFIXES = (".py", ".toml", ".xml", ".yaml", ".pgm", ".json", ".eds", ".typed")


def build_wheel(folder: Path, version: str, name: str = "vla-deploy") -> Path:
    """Pack the sources as a wheel; the real one needs a newer setuptools, and so a network."""
    stem = f"{name.replace('-', '_')}-{version}"
    wheel = folder / f"{stem}-py3-none-any.whl"
    info = f"{stem}.dist-info"
    with zipfile.ZipFile(wheel, "w") as archive:
        for package in ("vla_deploy", "drivers", "platforms"):
            for path in sorted((ROOT / package).rglob("*")):
                if path.suffix in SUFFIXES:
                    archive.write(path, str(path.relative_to(ROOT)))
        for path in sorted((ROOT / "systemd").iterdir()):
            archive.write(path, f"{stem}.data/data/share/vla-deploy/systemd/{path.name}")
        metadata = f"Metadata-Version: 2.1\nName: {name}\nVersion: {version}\n"
        archive.writestr(f"{info}/METADATA", metadata)
        tags = "Wheel-Version: 1.0\nGenerator: test\nRoot-Is-Purelib: true\nTag: py3-none-any\n"
        archive.writestr(f"{info}/WHEEL", tags)
        archive.writestr(f"{info}/RECORD", "")
    return wheel


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return build_wheel(tmp_path_factory.mktemp("wheels"), "9.8.7")


@pytest.mark.timeout(240)
def test_a_wheel_becomes_a_release_that_is_switched_to_and_back(
    wheel: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    def release(*words: str) -> str:
        assert main(["release", *words, "--root", str(tmp_path), "--json"]) == 0
        return capsys.readouterr().out

    prefix = tmp_path / "opt/vla-deploy"
    old = prefix / "releases/old/bin/vla-deploy"
    old.parent.mkdir(parents=True)
    old.write_text("#!/bin/sh\n")
    old.chmod(0o755)
    assert json.loads(release("switch", "old"))["end"] == "switched"
    os.umask(0o077)  # as root has it on a hardened computer; the service is another user
    added = json.loads(release("add", str(wheel), *UNSIGNED))["added"]
    made = (prefix / "releases" / added).rglob("*")
    assert all(path.stat().st_mode & 0o004 for path in made if not path.is_symlink())
    assert added.startswith("9.8.7-")
    assert json.loads(release("switch", added))["current"] == added  # it has checked the robot
    status = json.loads(release("status"))
    assert (status["current"], status["previous"]) == (added, "old")
    program = prefix / "current/bin/vla-deploy"
    words = [str(program), "install", "--root", str(tmp_path / "image"), "--json"]
    done = subprocess.run(words, capture_output=True, text=True, check=True, cwd="/")
    assert "vla-deploy.service" in done.stdout  # its templates came with it
    assert json.loads(release("rollback"))["current"] == "old"
    assert [row["use"] for row in json.loads(release("list"))] == ["current", "previous"]


def test_an_add_cut_off_leaves_nothing_under_the_final_name(wheel: Path, tmp_path: Path) -> None:
    words = ["release", "add", str(wheel), *UNSIGNED, "--id", "new"]
    command = [sys.executable, "-m", "vla_deploy.cli.main", *words, "--root", str(tmp_path)]
    process = subprocess.Popen(command)
    releases = tmp_path / "opt/vla-deploy/releases"
    while not (releases / ".incoming-new/venv/bin").is_dir():
        time.sleep(0.01)
    process.send_signal(signal.SIGKILL)
    process.wait()
    store = ReleaseStore(tmp_path / "opt/vla-deploy")
    assert store.ids() == ()
    assert list(store.incoming("new").iterdir()) == []  # the next add begins afresh


def test_a_wheel_that_cannot_be_installed_leaves_nothing(tmp_path: Path) -> None:
    name = "vla_deploy-1.0-py3-none-any.whl"
    wheel = CheckedWheel(name=name, data=b"no archive", version=Version("1.0"), lock="")
    store = ReleaseStore(tmp_path / "prefix")
    with pytest.raises(InstallError, match="pip"):
        add_release(store, "new", ReleaseSource(wheel=wheel, wheelhouse=tmp_path))
    assert list((tmp_path / "prefix/releases").iterdir()) == []


def test_a_file_that_is_no_wheel_of_ours_is_refused(tmp_path: Path) -> None:
    (tmp_path / "text.whl").write_text("hello")
    with pytest.raises(ReleaseRefused, match="is no wheel"):
        examined(tmp_path / "text.whl", keys=None)
    other = build_wheel(tmp_path, "1.0", name="other")
    with pytest.raises(ReleaseRefused, match="a wheel of other, expected vla-deploy"):
        examined(other, keys=None)


@pytest.mark.parametrize("name", ["../x", "", ".hidden", "a b"])
def test_an_id_that_is_no_folder_name_is_refused(tmp_path: Path, name: str) -> None:
    with pytest.raises(ReleaseRefused, match="expected letters"):
        ReleaseStore(tmp_path).incoming(name)


def test_an_id_is_taken_once(tmp_path: Path) -> None:
    store = ReleaseStore(tmp_path)
    store.incoming("one")
    store.accept("one")
    with pytest.raises(ReleaseRefused, match="is there already"):
        store.incoming("one")


def test_changing_releases_needs_root_but_looking_does_not(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    monkeypatch.setattr("os.geteuid", lambda: 1000)
    place = ("--prefix", str(tmp_path / "none"))
    assert main(["release", "list", *place]) == 0
    assert capsys.readouterr().out == "no release\n"
    assert main(["release", "rollback", *place]) == 2
    assert "only root may" in capsys.readouterr().err
