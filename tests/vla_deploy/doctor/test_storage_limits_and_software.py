import gzip
import shutil
import sys
from collections import namedtuple

import pytest

from vla_deploy.doctor import FindingLevel, limits, software, storage
from vla_deploy.inference.store import EMBEDDED

Room = namedtuple("Room", "f_bavail f_frsize")
CGROUP = "/sys/fs/cgroup/cgroup.controllers"


@pytest.mark.parametrize(
    ("free_mb", "level"),
    [
        (2000, FindingLevel.OK),
        (1999, FindingLevel.WARN),
        (500, FindingLevel.WARN),
        (499, FindingLevel.FAIL),
    ],
)
def test_disks_are_judged_by_what_the_profile_keeps_free(
    computer, monkeypatch, free_mb, level
) -> None:
    monkeypatch.setattr(storage.os, "statvfs", lambda path: Room(free_mb * 1000, 1000))
    findings = list(storage.disks(computer.context()))
    assert [one.level for one in findings] == [level, level]
    assert "/var/lib/vla-deploy" in findings[0].measured


@pytest.mark.parametrize(("free_mb", "level"), [(300, FindingLevel.OK), (268, FindingLevel.FAIL)])
def test_shared_memory_needs_room(computer, monkeypatch, free_mb, level) -> None:
    monkeypatch.setattr(storage.os, "statvfs", lambda path: Room(free_mb * 1000, 1000))
    (finding,) = storage.shared_memory(computer.context())
    assert finding.level is level


@pytest.mark.parametrize(
    ("total", "free", "swaps", "level", "words"),
    [
        (0, 0, "", FindingLevel.OK, "none"),
        (
            1000000,
            500000,
            "/dev/zram0 partition 1 1 5\n",
            FindingLevel.OK,
            "zram, 512 of 1024 MB used",
        ),
        (1000000, 1000000, "/swapfile file 1 0 -2\n", FindingLevel.OK, "0 of 1024 MB used"),
        (
            1000000,
            999000,
            "/swapfile file 1 1 -2\n",
            FindingLevel.WARN,
            "/swapfile, 1 of 1024 MB used",
        ),
    ],
)
def test_swap_on_a_disk_that_is_used_is_told(computer, total, free, swaps, level, words) -> None:
    computer.write("/proc/meminfo", f"SwapTotal:  {total} kB\nSwapFree:  {free} kB\n")
    computer.write("/proc/swaps", f"Filename Type Size Used Priority\n{swaps}")
    (finding,) = storage.swap(computer.context())
    assert finding.level is level
    assert words in finding.measured


@pytest.fixture
def groups(computer):
    """Put us into a group of our own that has two controllers."""
    computer.write("/proc/self/cgroup", "0::/robot\n")
    computer.write(CGROUP, "cpu memory pids\n")
    folder = "/sys/fs/cgroup/robot"
    computer.write(f"{folder}/cgroup.controllers", "cpu memory\n")
    for name in ("cpu.max", "memory.max"):
        computer.write(f"{folder}/{name}", "max\n")
    return computer


def limit_of(computer, name, profile="desktop"):
    findings = limits.control_groups(computer.context(profile))
    return next(one for one in findings if one.name == f"limit of {name}")


def test_each_controller_is_told_real_or_not(groups) -> None:
    assert limit_of(groups, "memory").level is FindingLevel.OK
    assert limit_of(groups, "cpu").level is FindingLevel.OK
    pids = limit_of(groups, "pids")
    assert pids.level is FindingLevel.WARN
    assert pids.measured == "not real, not enabled here: rlimits instead"
    assert pids.remedy.startswith("echo +pids")


def test_nothing_is_limited_in_the_root_group(groups) -> None:
    groups.write("/proc/self/cgroup", "0::/\n")
    memory = limit_of(groups, "memory")
    assert memory.level is FindingLevel.WARN
    assert "we are in the root group" in memory.measured
    assert memory.remedy.startswith("sudo vla-deploy install")


def test_a_controller_without_its_file_limits_nothing(groups) -> None:
    (groups.root / "sys/fs/cgroup/robot/cpu.max").unlink()
    cpu = limit_of(groups, "cpu")
    assert (cpu.level, limit_of(groups, "memory").level) == (FindingLevel.WARN, FindingLevel.OK)
    assert cpu.measured == "not real, the kernel has no cpu.max: nice and affinity instead"


def test_processor_time_is_not_limited_where_that_would_cost_control_its_priority(groups) -> None:
    options = gzip.compress(b"CONFIG_RT_GROUP_SCHED=y\n", mtime=0)
    groups.write("/proc/config.gz").write_bytes(options)
    cpu = limit_of(groups, "cpu", "robot")
    assert cpu.level is FindingLevel.WARN
    assert "RT_GROUP_SCHED would refuse SCHED_FIFO" in cpu.measured
    assert limit_of(groups, "memory", "robot").level is FindingLevel.OK


def test_a_jetson_is_told_that_cuda_memory_is_not_counted(board_tree, computer) -> None:
    computer.root = board_tree("orin_nano_8gb_super")
    assert limit_of(computer, "memory").measured == "real: memory, but not of CUDA memory"


@pytest.mark.parametrize("boot", ["/boot/extlinux/extlinux.conf", "/etc/default/grub"])
def test_old_control_groups_limit_nothing_and_the_remedy_fits_the_boot_loader(
    computer, boot
) -> None:
    computer.write("/proc/self/cgroup", "3:memory:/\n")
    computer.write(boot)
    (finding,) = limits.control_groups(computer.context())
    assert finding.level is FindingLevel.WARN
    assert f"sudoedit {boot}" in finding.remedy


@pytest.mark.parametrize(
    ("version", "level"),
    [
        ((3, 10, 12), FindingLevel.FAIL),
        ((3, 11, 0), FindingLevel.OK),
        ((3, 13, 9), FindingLevel.OK),
        ((3, 14, 0), FindingLevel.FAIL),
    ],
)
def test_the_interpreter_is_one_that_is_supported(computer, monkeypatch, version, level) -> None:
    monkeypatch.setattr(sys, "version_info", version)
    (finding,) = software.python(computer.context())
    assert finding.level is level


def test_every_required_package_is_installed_here(computer) -> None:
    findings = list(software.packages(computer.context()))
    assert findings[0].level is FindingLevel.OK
    assert int(findings[0].measured.split()[1]) >= 10


def test_a_package_that_is_not_there_fails_with_the_line_that_installs_it(
    computer, monkeypatch
) -> None:
    rows = ["numpy>=2", "no-such-package-of-ours>=1,<2", "gpiod; extra == 'gpio'"]
    monkeypatch.setattr(software.importlib.metadata, "requires", lambda name: rows)
    finding = next(software.packages(computer.context()))
    assert (finding.level, finding.remedy) == (
        FindingLevel.FAIL,
        "pip install no-such-package-of-ours",
    )


def put_model(folder, name, *, is_whole=True):
    """Copy a model that comes with the software into a folder, under another name."""
    shutil.copytree(EMBEDDED / "stop_words", folder / name)
    manifest = folder / name / "model.toml"
    manifest.write_text(manifest.read_text().replace("stop_words", name, 1))
    if not is_whole:
        (folder / name / "stop_words.onnx").write_bytes(b"half")


def test_models_that_are_not_there_are_named(computer) -> None:
    put_model(computer.root / "embedded", "medium")
    put_model(computer.root / "added", "small")
    found = {one.name: one for one in software.models(computer.context("robot"))}
    assert (found["detector"].level, found["detector"].measured) == (
        FindingLevel.OK,
        "medium, small",
    )
    assert (found["planner"].level, found["planner"].measured) == (
        FindingLevel.WARN,
        "no model planner_1b",
    )


def test_a_model_that_was_cut_off_is_told(computer) -> None:
    put_model(computer.root / "embedded", "medium")
    put_model(computer.root / "added", "small", is_whole=False)
    found = {one.name: one for one in software.models(computer.context("robot"))}
    assert found["detector"].level is FindingLevel.WARN
    assert "expected SHA-256" in found["detector"].measured


def test_a_folder_without_a_manifest_is_no_model(computer) -> None:
    (computer.root / "embedded/medium").mkdir(parents=True)
    found = {one.name: one for one in software.models(computer.context("robot"))}
    assert found["detector"].measured == "no model medium; no model small"


@pytest.mark.parametrize(
    ("answer", "level"),
    [
        ("ActiveState=active\nNRestarts=0\nResult=success\n", FindingLevel.OK),
        ("ActiveState=failed\nNRestarts=5\nResult=watchdog\n", FindingLevel.FAIL),
        ("ActiveState=inactive\nNRestarts=0\nResult=success\n", FindingLevel.WARN),
        ("", FindingLevel.WARN),
    ],
)
def test_the_service_is_judged_by_what_systemd_says(computer, answer, level) -> None:
    (absent,) = software.service(computer.context())
    assert (absent.level, absent.remedy) == (FindingLevel.MISSING, "sudo vla-deploy install")
    computer.write("/etc/systemd/system/vla-deploy.service", "[Unit]\n")
    computer.answers["systemctl"] = answer
    (finding,) = software.service(computer.context())
    assert finding.level is level


def test_without_egl_the_packages_are_named(computer) -> None:
    (finding,) = software.open_gl(computer.context())
    assert finding.level is FindingLevel.WARN
    assert "apt-get install -y libegl1" in finding.remedy
    computer.answers[sys.executable] = "EGL 1.5\n"
    (finding,) = software.open_gl(computer.context())
    assert (finding.level, finding.measured) == (FindingLevel.OK, "EGL 1.5")
