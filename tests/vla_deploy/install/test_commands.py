"""A computer without systemd is refused untouched, and what was installed comes off it."""

from pathlib import Path

import pytest

from vla_deploy.cli.main import main
from vla_deploy.install import InstallLayout
from vla_deploy.install.commands import missing_tools


class Here(InstallLayout):
    """Take a folder for this computer."""

    is_this_computer = True


@pytest.fixture
def bare(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return the root of a computer that has `rm` and nothing else."""
    root, programs = tmp_path / "root", tmp_path / "bin"
    root.mkdir()
    programs.mkdir()
    (programs / "rm").symlink_to("/bin/rm")
    monkeypatch.setenv("PATH", str(programs))
    return root


@pytest.fixture
def here(bare: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("vla_deploy.cli.maintenance.install.layout_of", lambda _: Here(root=bare))


def files(root: Path) -> list[Path]:
    return [path for path in root.rglob("*") if path.is_file()]


@pytest.mark.usefixtures("here")
def test_install_names_what_is_missing_before_it_writes(
    bare: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["install"]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    for tool in ("systemctl", "udevadm", "systemd-sysusers", "systemd-tmpfiles"):
        assert f"{tool} is not on the PATH" in error
    assert "--root DIR" in error
    assert list(bare.iterdir()) == []


def test_uninstall_skips_what_cannot_run_and_removes_every_file(
    bare: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    assert main(["install", "--root", str(bare)]) == 0
    state = bare / "var/lib/vla-deploy/profile.json"
    state.parent.mkdir(parents=True)
    state.write_text("{}")
    monkeypatch.setattr("vla_deploy.cli.maintenance.install.layout_of", lambda _: Here(root=bare))
    assert main(["uninstall", "--purge"]) == 0
    skipped = capsys.readouterr().err.splitlines()
    assert [line.split()[2] for line in skipped] == [
        "systemctl",
        "udevadm",
        "systemctl",
        "userdel",
    ]
    assert files(bare) == []


def test_a_program_without_its_service_is_missing_too(tmp_path: Path) -> None:
    commands = (("sh", "-c", "true"),)
    assert missing_tools(commands, {}) == {}
    gone = tmp_path / "gone"
    assert missing_tools(commands, {"sh": gone}) == {
        "sh": f"sh reaches nobody, as there is no {gone}"
    }
