"""The page that says what shows each part of the documents names tests and files that exist."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "documents.md"
FOLDERS = ("", "tests/vla_deploy", "tests/end_to_end", "tests/end_to_end/ros")
NAMED = re.compile(r"`(?P<path>[\w./-]*?[\w-]+\.py)?(?:::(?P<test>test_\w+))?`")


def file_of(path: str) -> Path | None:
    """Return the file that a path of the page means."""
    below = (ROOT / folder / path for folder in FOLDERS)
    return next((one for one in below if one.is_file()), None)


def named() -> list[tuple[str, str]]:
    """Return each file of tests with a test of it; what has no folder is beside the one before."""
    found, path = [], ""
    for one in NAMED.finditer(PAGE.read_text(encoding="utf-8")):
        beside = (Path(path).parent / (one["path"] or "none")).as_posix()
        path = beside if file_of(beside) else one["path"] or path
        if (one["path"] and "test_" in one["path"]) or one["test"]:
            found.append((path, one["test"] or ""))
    return found


@pytest.mark.parametrize(("path", "test"), named())
def test_what_the_page_names_is_there(path: str, test: str) -> None:
    file = file_of(path)
    assert file is not None, path
    assert not test or f"def {test}(" in file.read_text(encoding="utf-8"), f"{path}::{test}"


def test_the_page_names_many() -> None:
    assert len(named()) > 80
