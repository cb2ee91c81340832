import tomllib
from collections.abc import Callable
from pathlib import Path

import pytest

from platforms.board import BY_CHIP, MODULES, identify
from platforms.profile import profile_names

TREES = sorted((Path(__file__).parent / "trees").glob("*.toml"))
BoardTree = Callable[[str], Path]


def write(root: Path, path: str, text: str) -> None:
    file = root / path.lstrip("/")
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(text)


@pytest.mark.parametrize("tree", TREES, ids=lambda tree: tree.stem)
def test_each_described_board_is_identified(tree: Path, board_tree: BoardTree) -> None:
    expected = tomllib.loads(tree.read_text())["board"]
    board = identify(board_tree(tree.stem))
    assert {key: getattr(board, key) for key in expected} == expected


def test_the_name_is_that_of_the_device_tree(board_tree: BoardTree) -> None:
    assert identify(board_tree("thor_t5000")).name == "NVIDIA Jetson AGX Thor Developer Kit"


def test_nothing_at_all_is_a_desktop_of_unknown_size_with_reasons(tmp_path: Path) -> None:
    board = identify(tmp_path)
    assert board.profile_name == "desktop"
    assert (board.memory_bytes, board.l4t, board.jetpack, board.module) == (None,) * 4
    assert any("there is no /proc/meminfo" in reason for reason in board.reasons)


@pytest.mark.parametrize("part", MODULES)
def test_every_known_part_number_has_its_profile(tmp_path: Path, part: str) -> None:
    write(tmp_path, "/proc/device-tree/compatible", f"vendor,board\0nvidia,{part}\0nvidia,tegra\0")
    assert identify(tmp_path).profile_name == MODULES[part].profile


def test_every_profile_that_a_board_may_get_is_there() -> None:
    named = {module.profile for module in MODULES.values()}
    named |= {module.super_profile for module in MODULES.values() if module.super_profile}
    named |= {profile for _, _, profile in BY_CHIP}
    assert named <= set(profile_names())


def test_the_super_modes_are_known_by_the_power_modes_alone(board_tree: BoardTree) -> None:
    root = board_tree("orin_nano_8gb_super")
    write(root, "/proc/device-tree/model", "NVIDIA Jetson Orin Nano\0")
    write(root, "/proc/device-tree/compatible", "nvidia,p3767-0003\0nvidia,tegra234\0")
    assert identify(root).profile_name == "jetson_orin_nano_8gb_super"
    (root / "etc/nvpmodel.conf").unlink()
    assert identify(root).profile_name == "jetson_orin_nano_8gb"


@pytest.mark.parametrize(
    ("gib", "profile"),
    [
        (4, "jetson_orin_nano_4gb"),
        (8, "jetson_orin_nano_8gb"),
        (16, "jetson_orin_nx"),
        (64, "jetson_agx_orin"),
    ],
)
def test_an_unknown_module_of_a_known_chip_gets_the_profile_of_its_memory(
    tmp_path: Path, gib: int, profile: str
) -> None:
    write(tmp_path, "/proc/device-tree/compatible", "maker,carrier\0nvidia,tegra234\0")
    write(tmp_path, "/proc/meminfo", f"MemTotal:  {gib << 20} kB\n")
    board = identify(tmp_path)
    assert board.profile_name == profile
    assert any("unknown module" in reason for reason in board.reasons)


def test_a_board_of_another_maker_has_no_profile(tmp_path: Path) -> None:
    write(tmp_path, "/proc/device-tree/model", "Raspberry Pi 5 Model B\0")
    write(tmp_path, "/proc/device-tree/compatible", "raspberrypi,5-model-b\0brcm,bcm2712\0")
    board = identify(tmp_path)
    assert board.profile_name is None
    assert "Raspberry Pi 5" in board.reasons[-1]


def test_an_unknown_release_leaves_everything_else_known(board_tree: BoardTree) -> None:
    root = board_tree("orin_nx_16gb")
    write(root, "/etc/nv_tegra_release", "# R44 (release), REVISION: 1.0, GCID: 1\n")
    board = identify(root)
    assert (board.l4t, board.jetpack, board.profile_name) == ("44.1.0", None, "jetson_orin_nx")
    assert "the JetPack release of L4T 44.1.0 is not known here" in board.reasons


@pytest.mark.parametrize("path", ["/etc/nv_tegra_release", "/proc/meminfo", "/etc/nvpmodel.conf"])
def test_garbage_is_told_and_harms_nothing_else(board_tree: BoardTree, path: str) -> None:
    root = board_tree("agx_orin_64gb")
    (root / path.lstrip("/")).write_bytes(b"\xff\xfe garbage \0\0")
    assert identify(root).profile_name == "jetson_agx_orin"


def test_each_chip_ends_with_a_profile_for_any_memory() -> None:
    assert {chip for chip, _, _ in BY_CHIP} == {
        chip for chip, below_gib, _ in BY_CHIP if below_gib == float("inf")
    }
