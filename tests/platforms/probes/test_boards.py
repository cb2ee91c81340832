import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from platforms.probes import open_probes, read_power_modes
from platforms.tree import Tree

TREES = sorted((Path(__file__).parents[1] / "trees").glob("*.toml"))
BUSY = "cpu  2000 0 1500 9500 1000 0 0 0 0 0"  # 2000 of 4000 ticks more were busy
BoardTree = Callable[[str], Path]


@pytest.fixture(params=TREES, ids=lambda tree: tree.stem)
def described(request: pytest.FixtureRequest, board_tree: BoardTree) -> tuple[dict[str, Any], Path]:
    return tomllib.loads(request.param.read_text()), board_tree(request.param.stem)


def test_each_described_board_gives_exactly_its_readings(
    described: tuple[dict[str, Any], Path],
) -> None:
    description, root = described
    with open_probes(root) as probes:
        stat = root / "proc/stat"
        stat.write_text("\n".join([BUSY, *stat.read_text().splitlines()[1:]]))
        readings = probes.read()
    found = {name: readings[name].value for name in description["expected"]}
    assert found == pytest.approx(description["expected"])


def test_what_a_board_lacks_is_missing_with_its_reason(
    described: tuple[dict[str, Any], Path],
) -> None:
    description, root = described
    with open_probes(root) as probes:
        readings = probes.read()
    for name, words in description["missing"].items():
        assert readings[name].value is None
        assert readings[name].reason.startswith("missing, because ")
        assert words in readings[name].reason


def test_power_modes_are_parsed_and_read_back(described: tuple[dict[str, Any], Path]) -> None:
    description, root = described
    modes = read_power_modes(Tree(root))
    expected = description.get("power_modes", {"current": None, "default": None})
    assert (modes.current_name, modes.default) == (expected["current"], expected["default"])
    assert bool(modes.reason) is ("power_modes" not in description)


def test_every_reading_has_either_a_value_or_a_reason(
    described: tuple[dict[str, Any], Path],
) -> None:
    with open_probes(described[1]) as probes:
        for name, reading in probes.read().items():
            assert reading.name == name
            assert (reading.value is None) is bool(reading.reason)


def test_all_handles_are_given_back(described: tuple[dict[str, Any], Path]) -> None:
    before = len(list(Path("/proc/self/fd").iterdir()))
    with open_probes(described[1]) as probes:
        probes.read()
        opened = len(list(Path("/proc/self/fd").iterdir()))
        for _ in range(3):
            probes.read()
        assert len(list(Path("/proc/self/fd").iterdir())) == opened > before
    assert len(list(Path("/proc/self/fd").iterdir())) == before
