import errno
import random
import re
from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from platforms.board import identify
from platforms.probes import open_probes, read_power_modes
from platforms.probes.memory import meminfo_bytes, nvmap_bytes
from platforms.tree import Tree, ValueMissing

BOARD = "orin_nano_8gb_super"
GARBAGE = (b"", b"\n", b"\xff\xfe\x00\x01", b"nan", b"-1", b"1e400", b"ten", b"9" * 400, b"1 2 3\n")
ERRORS = (errno.EAGAIN, errno.EACCES, errno.EIO, errno.ENODEV, errno.ETIMEDOUT)
BoardTree = Callable[[str], Path]


def files_of(root: Path) -> list[Path]:
    return sorted(path for path in root.rglob("*") if path.is_file())


def read_all(root: Path) -> None:
    with open_probes(root) as probes:
        for _ in range(2):
            for reading in probes.read().values():
                assert (reading.value is None) is bool(reading.reason)


def test_an_empty_root_lacks_everything_but_the_disk(tmp_path: Path) -> None:
    with open_probes(tmp_path) as probes:
        readings = probes.read()
    known = {name for name, reading in readings.items() if reading.value is not None}
    assert known == {
        "disk_free_bytes",
        "disk_free_bytes./",
        "disk_free_ratio",
        "disk_free_ratio./",
    }


@pytest.mark.parametrize("garbage", GARBAGE)
def test_garbage_in_every_file_raises_nothing(board_tree: BoardTree, garbage: bytes) -> None:
    root = board_tree(BOARD)
    for path in files_of(root):
        path.write_bytes(garbage)
    read_all(root)


def test_numbers_of_thousands_of_digits_raise_nothing(board_tree: BoardTree) -> None:
    root = board_tree(BOARD)
    for path in files_of(root):
        path.write_text(re.sub(r"\d+", "9" * 5000, path.read_text()))
    read_all(root)
    identify(root)
    read_power_modes(Tree(root))


@pytest.mark.parametrize("seed", range(10))
def test_any_mixture_of_troubles_raises_nothing(
    board_tree: BoardTree, failing_reads: dict[Path, int], seed: int
) -> None:
    draw, root = random.Random(seed), board_tree(BOARD)
    for path in files_of(root):
        trouble = draw.randrange(4)
        if trouble == 0:
            path.unlink()
        elif trouble == 1:
            path.write_bytes(draw.choice(GARBAGE))
        elif trouble == 2:
            failing_reads[path] = draw.choice(ERRORS)
    read_all(root)


@pytest.mark.parametrize("number", ERRORS)
def test_a_file_that_fails_is_missing_and_the_others_are_read(
    board_tree: BoardTree, failing_reads: dict[Path, int], number: int
) -> None:
    root = board_tree(BOARD)
    failing_reads[root / "sys/class/devfreq/17000000.gpu/device/load"] = number
    with open_probes(root) as probes:
        readings = probes.read()
    assert readings["gpu_load_ratio"].value is None
    assert "/sys/class/devfreq/17000000.gpu/device/load" in readings["gpu_load_ratio"].reason
    assert readings["gpu_frequency_hz"].value == 612e6


def test_files_that_vanish_between_two_reads_raise_nothing(board_tree: BoardTree) -> None:
    root = board_tree(BOARD)
    with open_probes(root) as probes:
        probes.read()
        for path in files_of(root):
            path.unlink()
            probes.read()
        assert probes.read()["memory_available_bytes"].value is None


@given(st.text())
def test_any_table_of_clients_is_parsed_or_missing(text: str) -> None:
    try:
        sizes = nvmap_bytes(text)
    except ValueMissing:
        return
    assert all(size >= 0 for size in sizes.values())


@given(st.text())
def test_any_meminfo_is_parsed(text: str) -> None:
    assert all(size >= 0 for size in meminfo_bytes(text).values())
