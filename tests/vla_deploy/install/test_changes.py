"""Installing twice changes nothing, edits are kept, uninstalling takes away what was written."""

import json
from pathlib import Path
from typing import Any

import pytest

from vla_deploy.cli.main import main

SERVICE = Path("etc/systemd/system/vla-deploy.service")


def run(capsys: pytest.CaptureFixture[str], *words: str) -> dict[str, Any]:
    assert main([*words, "--json"]) == 0
    report: dict[str, Any] = json.loads(capsys.readouterr().out)
    return report


def kinds(report: dict[str, Any]) -> dict[str, str]:
    return {Path(file["path"]).name: file["change"] for file in report["files"]}


def tree(root: Path) -> dict[str, bytes]:
    return {str(path): path.read_bytes() for path in root.rglob("*") if path.is_file()}


def test_a_second_install_changes_nothing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    first = run(capsys, "install", "--root", str(tmp_path))
    assert set(kinds(first).values()) == {"write"}
    before = tree(tmp_path)
    second = run(capsys, "install", "--root", str(tmp_path))
    assert set(kinds(second).values()) == {"same"}
    assert tree(tmp_path) == before


def test_a_dry_run_shows_the_text_and_writes_nothing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["install", "--root", str(tmp_path), "--dry-run"]) == 0
    shown = capsys.readouterr().out
    assert "+WatchdogSec=15\n" in shown
    assert f"+++ b/{SERVICE}" in shown
    assert list(tmp_path.iterdir()) == []


def test_a_dry_run_for_this_computer_lists_the_commands(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["install", "--dry-run"]) == 0
    shown = capsys.readouterr().out
    assert "run: systemctl daemon-reload\n" in shown
    assert "run: systemctl enable vla-deploy.service vla-deploy-can.service\n" in shown


def test_this_computer_is_changed_by_root_only(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("os.geteuid", lambda: 1000)
    assert main(["install"]) == 2
    assert "use sudo; look first with --dry-run" in capsys.readouterr().err


def test_a_new_choice_updates_what_nobody_edited(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run(capsys, "install", "--root", str(tmp_path))
    report = kinds(run(capsys, "install", "--root", str(tmp_path), "--twin"))
    assert report["vla-deploy.service"] == "update"
    assert report["vla-deploy-can.service"] == "remove"  # the twin has no CAN link
    assert not (tmp_path / SERVICE).with_name("vla-deploy-can.service").exists()


def test_an_edited_file_is_kept_with_the_new_version_beside_it(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run(capsys, "install", "--root", str(tmp_path))
    mine = (tmp_path / SERVICE).read_text().replace("WatchdogSec=15", "WatchdogSec=9")
    (tmp_path / SERVICE).write_text(mine)
    report = kinds(run(capsys, "install", "--root", str(tmp_path), "--twin"))
    assert report["vla-deploy.service"] == "keep, as it is edited"
    assert report["vla-deploy.service.vla-new"] == "write beside the edited one"
    assert (tmp_path / SERVICE).read_text() == mine
    beside = (tmp_path / SERVICE).with_name("vla-deploy.service.vla-new")
    (tmp_path / SERVICE).write_text(beside.read_text())  # the person takes the new version
    report = kinds(run(capsys, "install", "--root", str(tmp_path), "--twin"))
    assert report["vla-deploy.service"] == "same"
    assert report["vla-deploy.service.vla-new"] == "remove"
    assert not beside.exists()


def test_a_file_of_someone_else_is_neither_overwritten_nor_removed(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    wrapper = tmp_path / "usr/local/bin/vla-deploy"
    wrapper.parent.mkdir(parents=True)
    wrapper.write_text("mine\n")
    run(capsys, "install", "--root", str(tmp_path))
    run(capsys, "uninstall", "--root", str(tmp_path))
    assert list(tree(tmp_path)) == [str(wrapper)]
    assert wrapper.read_text() == "mine\n"


def test_uninstall_removes_exactly_what_install_wrote(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    state = tmp_path / "var/log/vla-deploy/flight.mcap"
    release = tmp_path / "opt/vla-deploy/releases/1/bin/vla-deploy"
    for file in (state, release):
        file.parent.mkdir(parents=True)
        file.write_text("keep me")
    before = tree(tmp_path)
    run(capsys, "install", "--root", str(tmp_path))
    run(capsys, "uninstall", "--root", str(tmp_path))
    assert tree(tmp_path) == before


def test_purge_takes_state_and_releases_too(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run(capsys, "install", "--root", str(tmp_path))
    state = tmp_path / "var/log/vla-deploy/flight.mcap"
    state.parent.mkdir(parents=True)
    state.write_text("old")
    run(capsys, "uninstall", "--root", str(tmp_path), "--purge")
    assert tree(tmp_path) == {}
    assert not (tmp_path / "opt/vla-deploy").exists()


@pytest.mark.parametrize("prefix", ["/home/me", "/nowhere"])
def test_purge_refuses_a_prefix_that_is_no_installation(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], prefix: str
) -> None:
    run(capsys, "install", "--root", str(tmp_path))
    mine = tmp_path / "home/me/releases/notes"
    mine.parent.mkdir(parents=True)
    mine.write_text("keep me")
    before = tree(tmp_path)
    command = ["uninstall", "--purge", "--root", str(tmp_path), "--prefix", prefix]
    assert main([*command, "--dry-run"]) == main(command) == 2
    assert f"--prefix {prefix}: expected an installation" in capsys.readouterr().err
    assert tree(tmp_path) == before


def test_purge_takes_of_a_shared_prefix_only_what_is_ours(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    layout = ("--root", str(tmp_path), "--prefix", "/opt")
    release, mine = tmp_path / "opt/releases/1/bin/vla-deploy", tmp_path / "opt/other/bin/tool"
    for file in (release, mine):
        file.parent.mkdir(parents=True)
        file.write_text("x")
    (tmp_path / "opt/current").symlink_to("releases/1")
    run(capsys, "install", *layout)
    run(capsys, "uninstall", *layout, "--purge")
    assert list(tree(tmp_path)) == [str(mine)]
    assert sorted(path.name for path in (tmp_path / "opt").iterdir()) == ["other"]


def test_what_uninstall_left_may_be_purged_later(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    release = tmp_path / "opt/vla-deploy/releases/1/bin/vla-deploy"
    release.parent.mkdir(parents=True)
    release.write_text("x")
    run(capsys, "install", "--root", str(tmp_path))
    run(capsys, "uninstall", "--root", str(tmp_path))
    run(capsys, "uninstall", "--root", str(tmp_path), "--purge")
    assert tree(tmp_path) == {}
    assert not (tmp_path / "opt/vla-deploy").exists()


def test_an_edited_file_outlives_uninstall_and_is_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run(capsys, "install", "--root", str(tmp_path))
    (tmp_path / SERVICE).write_text("mine\n")
    report = kinds(run(capsys, "uninstall", "--root", str(tmp_path)))
    assert report["vla-deploy.service"] == "keep, as it is edited"
    assert list(tree(tmp_path)) == [str(tmp_path / SERVICE)]


def test_an_install_cut_off_before_any_file_is_taken_up_again(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    run(capsys, "install", "--root", str(tmp_path))

    def power_cut(*_: object) -> None:
        raise KeyboardInterrupt

    with monkeypatch.context() as cut:
        cut.setattr("vla_deploy.cli.maintenance.install.apply_changes", power_cut)
        assert main(["install", "--root", str(tmp_path), "--twin"]) == 130
    capsys.readouterr()
    report = kinds(run(capsys, "install", "--root", str(tmp_path), "--twin"))
    assert report["vla-deploy.service"] == "update"  # the old version is still known as ours


def test_a_damaged_manifest_is_an_error_that_loses_nothing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run(capsys, "install", "--root", str(tmp_path))
    (tmp_path / "opt/vla-deploy/manifest.json").write_text('{"files": ', encoding="utf-8")
    before = tree(tmp_path)
    assert main(["uninstall", "--root", str(tmp_path)]) == 2
    assert "is damaged" in capsys.readouterr().err
    assert tree(tmp_path) == before
