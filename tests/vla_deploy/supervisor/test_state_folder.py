from pathlib import Path

import pytest

from vla_deploy.supervisor.state_folder import BoundedFolder, state_dir_of, user_base


def fill(folder: BoundedFolder, *names: str) -> list[str]:
    for name in names:
        folder.claim(name).write_text(name)
    return [path.name for path in folder.entries()]


def test_entries_are_numbered_in_the_order_they_came(tmp_path):
    folder = BoundedFolder(tmp_path / "crashes", keep=5)
    assert fill(folder, "b", "a") == ["000001-b", "000002-a"]


def test_the_oldest_is_removed_for_one_too_many(tmp_path):
    folder = BoundedFolder(tmp_path, keep=2)
    assert fill(folder, "a", "b", "c") == ["000002-b", "000003-c"]


def test_numbers_go_on_after_the_oldest_are_gone_so_that_no_clock_is_asked(tmp_path):
    fill(BoundedFolder(tmp_path, keep=1), *"abcd")
    assert fill(BoundedFolder(tmp_path, keep=1), "e") == ["000005-e"]


def test_folders_are_removed_with_what_they_hold(tmp_path):
    folder = BoundedFolder(tmp_path, keep=1)
    run = folder.claim("run")
    run.mkdir()
    (run / "control.log").touch()
    fill(folder, "next")
    assert not run.exists()


def test_what_somebody_else_put_there_stays(tmp_path):
    (tmp_path / "README").touch()
    folder = BoundedFolder(tmp_path, keep=1)
    fill(folder, "a", "b")
    assert (tmp_path / "README").exists()


def test_a_folder_that_does_not_exist_is_empty(tmp_path):
    assert BoundedFolder(tmp_path / "none", keep=1).entries() == []


@pytest.mark.parametrize(
    ("base", "state"),
    [("/run/vla-deploy", "/var/log/vla-deploy"), ("/tmp/x/base", "/tmp/x/base-state")],
)
def test_what_outlives_a_run_lies_beside_a_chosen_runtime_directory(base, state):
    assert state_dir_of(Path(base)) == Path(state)


def test_a_users_runs_leave_it_in_the_users_state_directory(monkeypatch, tmp_path):
    monkeypatch.setenv("XDG_RUNTIME_DIR", "/run/user/1000")
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    assert state_dir_of(user_base()) == tmp_path / "vla-deploy"
    monkeypatch.delenv("XDG_STATE_HOME")
    monkeypatch.setenv("HOME", "/home/ann")
    assert state_dir_of(user_base()) == Path("/home/ann/.local/state/vla-deploy")
