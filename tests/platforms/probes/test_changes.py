"""What changes while the probes are open: counters, late devices, clocks that stand still."""

import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from platforms.probes import open_probes, read_cgroup
from platforms.tree import Tree

BoardTree = Callable[[str], Path]


def write(root: Path, path: str, text: str) -> None:
    file = root / path.lstrip("/")
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(text)


def test_a_gpu_that_appears_late_is_found(board_tree: BoardTree, tmp_path: Path) -> None:
    root = board_tree("orin_nano_8gb_super")
    gpu = root / "sys/class/devfreq/17000000.gpu"
    gpu.rename(tmp_path / "later")
    with open_probes(root) as probes:
        reading = probes.read()["gpu_load_ratio"]
        assert reading.value is None
        assert "tells a GPU" in reading.reason
        (tmp_path / "later").rename(gpu)
        assert probes.read()["gpu_load_ratio"].value == pytest.approx(0.437)


def test_a_gpu_that_goes_and_comes_again_is_found(board_tree: BoardTree, tmp_path: Path) -> None:
    root = board_tree("orin_nano_8gb_super")
    gpu = root / "sys/class/devfreq/17000000.gpu"
    with open_probes(root) as probes:
        probes.read()
        gpu.rename(tmp_path / "away")
        assert probes.read()["gpu_load_ratio"].value is None
        (tmp_path / "away/device/load").write_text("250\n")
        (tmp_path / "away").rename(gpu)
        assert probes.read()["gpu_load_ratio"].value == 0.25


def test_power_rails_that_appear_late_are_found(board_tree: BoardTree, tmp_path: Path) -> None:
    root = board_tree("orin_nano_8gb_super")
    (root / "sys/class/hwmon/hwmon1").rename(tmp_path / "later")
    with open_probes(root) as probes:
        assert probes.read()["power_w"].value is None
        (tmp_path / "later").rename(root / "sys/class/hwmon/hwmon1")
        assert probes.read()["power_w"].value == pytest.approx(4.984 * 1.512)


def test_throttling_is_counted_since_the_last_reading(board_tree: BoardTree) -> None:
    root = board_tree("orin_nano_8gb_super")
    counter = root / "sys/class/hwmon/hwmon2/oc3_event_cnt"
    with open_probes(root) as probes:
        assert probes.read()["throttle_events.oc3"].value == 0
        counter.write_text("125\n")
        assert probes.read()["throttle_events.oc3"].value == 8
        readings = probes.read()
        assert readings["throttle_events.oc3"].value == 0
        assert readings["throttle_count.oc3"].value == 125


def test_a_counter_that_goes_back_gives_no_events(board_tree: BoardTree) -> None:
    root = board_tree("orin_nano_8gb_super")
    counter = root / "sys/class/hwmon/hwmon2/oc3_event_cnt"
    with open_probes(root) as probes:
        counter.write_text("3\n")
        reading = probes.read()["throttle_events.oc3"]
        assert reading.value is None
        assert "went back from 117 to 3" in reading.reason
        counter.write_text("5\n")
        assert probes.read()["throttle_events.oc3"].value == 2


def test_processor_counters_that_stand_still_tell_no_load(board_tree: BoardTree) -> None:
    with open_probes(board_tree("desktop")) as probes:
        reading = probes.read()["cpu_ratio"]
    assert reading.value is None
    assert "have not moved on" in reading.reason


def test_the_load_is_that_since_the_last_reading(board_tree: BoardTree) -> None:
    root = board_tree("desktop")
    with open_probes(root) as probes:
        write(root, "/proc/stat", "cpu 1100 0 500 8300 500 0 0 0\ncpu0 1\n")
        assert probes.read()["cpu_ratio"].value == pytest.approx(0.25)
        write(root, "/proc/stat", "cpu 1100 0 500 8400 500 0 0 0\ncpu0 1\n")
        assert probes.read()["cpu_ratio"].value == 0


def test_a_sum_of_rails_that_lacks_one_is_missing(board_tree: BoardTree) -> None:
    root = board_tree("agx_orin_64gb")
    (root / "sys/class/hwmon/hwmon3/curr2_input").unlink()
    with open_probes(root) as probes:
        readings = probes.read()
    assert readings["power_w"].value is None
    assert "curr2_input" in readings["power_w"].reason
    assert readings["power_w.VDD_GPU_SOC"].value is not None


def test_a_total_rail_needs_no_other(board_tree: BoardTree) -> None:
    root = board_tree("orin_nano_8gb_super")
    (root / "sys/class/hwmon/hwmon1/curr2_input").unlink()
    with open_probes(root) as probes:
        assert probes.read()["power_w"].value == pytest.approx(4.984 * 1.512)


@pytest.mark.parametrize(
    ("path", "text", "name"),
    [
        ("/sys/class/devfreq/17000000.gpu/device/load", "1001", "gpu_load_ratio"),
        ("/sys/class/devfreq/17000000.gpu/device/load", "-1", "gpu_load_ratio"),
        ("/sys/class/thermal/thermal_zone0/temp", "250000", "temperature_c.cpu-thermal"),
        ("/sys/kernel/debug/cactmon/mc_all", "999999999999", "emc_load_ratio"),
        ("/sys/kernel/debug/bpmp/debug/clk/emc/rate", "0", "emc_load_ratio"),
    ],
)
def test_what_cannot_be_is_missing(board_tree: BoardTree, path: str, text: str, name: str) -> None:
    root = board_tree("orin_nano_8gb_super")
    write(root, path, text)
    with open_probes(root) as probes:
        assert probes.read()[name].value is None


def test_the_disk_without_a_name_is_the_tightest(tmp_path: Path) -> None:
    (tmp_path / "state").mkdir()
    folders = (Path("/state"), Path("/away"))
    with open_probes(tmp_path, disk_folders=folders[:1]) as probes:
        readings = probes.read()
        assert readings["disk_free_bytes"].value == readings["disk_free_bytes./state"].value
        expected = shutil.disk_usage(tmp_path)
        assert readings["disk_free_ratio"].value == pytest.approx(
            expected.free / expected.total, rel=0.2
        )
    with open_probes(tmp_path, disk_folders=folders) as probes:
        readings = probes.read()
    assert readings["disk_free_bytes"].value is None
    assert "away" in readings["disk_free_bytes"].reason


def test_the_old_control_groups_are_told_from_the_new(tmp_path: Path) -> None:
    assert read_cgroup(Tree(tmp_path)).version == 0
    write(tmp_path, "/proc/self/cgroup", "4:memory:/\n0::/\n")
    assert read_cgroup(Tree(tmp_path)).version == 1
    write(tmp_path, "/sys/fs/cgroup/unified/cgroup.controllers", "\n")
    mixed = read_cgroup(Tree(tmp_path))
    assert (mixed.version, mixed.controllers) == (2, ())
    assert mixed.reason == "version 1 holds the other controllers"


def test_the_control_group_is_ours(board_tree: BoardTree) -> None:
    cgroup = read_cgroup(Tree(board_tree("orin_nano_8gb_super")))
    assert cgroup.folder == "/sys/fs/cgroup/system.slice/vla-deploy.service"
    assert {"cpu", "memory"} <= set(cgroup.controllers)
