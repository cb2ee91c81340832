import errno
from pathlib import Path

import pytest

from platforms.tree import Tree, ValueMissing, number_in


@pytest.fixture
def tree(tmp_path: Path) -> Tree:
    return Tree(tmp_path)


def test_a_file_is_read_anew_through_one_handle(tree: Tree, tmp_path: Path) -> None:
    file = tree.file("/load")
    (tmp_path / "load").write_text("1\n")
    assert file.number() == 1
    (tmp_path / "load").write_text("2\n")
    assert file.number() == 2


def test_a_file_put_in_another_ones_place_is_read(tree: Tree, tmp_path: Path) -> None:
    file = tree.file("/status")
    (tmp_path / "status").write_text("old")
    assert file.text() == "old"
    (tmp_path / "new").write_text("new")
    (tmp_path / "new").rename(tmp_path / "status")
    assert file.text() == "new"


def test_a_file_that_vanishes_and_comes_back_is_read(tree: Tree, tmp_path: Path) -> None:
    file = tree.file("/load")
    (tmp_path / "load").write_text("1")
    assert file.number() == 1
    (tmp_path / "load").unlink()
    with pytest.raises(ValueMissing, match="there is no /load"):
        file.number()
    (tmp_path / "load").write_text("3")
    assert file.number() == 3


@pytest.mark.parametrize(
    ("number", "words"),
    [
        (errno.EAGAIN, "/load is asleep"),
        (errno.EACCES, "/load may be read by root only"),
        (errno.EIO, "/load: Input/output error"),
        (errno.ENODEV, "/load: No such device"),
    ],
)
def test_a_read_that_fails_says_why_and_works_again_later(
    tree: Tree, tmp_path: Path, failing_reads: dict[Path, int], number: int, words: str
) -> None:
    (tmp_path / "load").write_text("7")
    failing_reads[tmp_path / "load"] = number
    file = tree.file("/load")
    with pytest.raises(ValueMissing, match=words):
        file.number()
    failing_reads.clear()
    assert file.number() == 7


@pytest.mark.parametrize("text", ["", "\0", "many", "nan", "inf", "1e999", "0x10", "1 2"])
def test_what_is_no_number_is_missing_and_never_zero(text: str) -> None:
    with pytest.raises(ValueMissing, match="expected a"):
        number_in(text, "/load")


def test_bytes_that_are_no_text_are_missing(tree: Tree, tmp_path: Path) -> None:
    (tmp_path / "load").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(ValueMissing, match="is not text"):
        tree.file("/load").text()


def test_a_folder_in_a_files_place_is_missing(tree: Tree, tmp_path: Path) -> None:
    (tmp_path / "load").mkdir()
    with pytest.raises(ValueMissing, match="directory"):
        tree.file("/load").text()


def test_a_long_file_is_read_whole(tree: Tree, tmp_path: Path) -> None:
    (tmp_path / "clients").write_text("x" * 100_000)
    assert len(tree.text("/clients")) == 100_000


def test_closing_gives_every_handle_back(tree: Tree, tmp_path: Path) -> None:
    (tmp_path / "load").write_text("1")
    before = len(list(Path("/proc/self/fd").iterdir()))
    tree.file("/load").number()
    assert len(list(Path("/proc/self/fd").iterdir())) == before + 1
    tree.close()
    assert len(list(Path("/proc/self/fd").iterdir())) == before


def test_a_folder_that_is_not_there_holds_nothing(tree: Tree) -> None:
    assert tree.names("/sys/class/devfreq") == ()
