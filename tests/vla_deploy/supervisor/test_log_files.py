from vla_deploy.supervisor.runs.log_files import BoundedFolder


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
